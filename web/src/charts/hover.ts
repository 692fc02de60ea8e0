/** Where the pointer is in a plot, in the plot's own values. */

import { svg } from "../dom";
import type { Frame } from "./frame";

export interface Place {
  readonly x: number;
  readonly y: number;
}

/** Calls back with the place of the pointer or of a tap, null when it has left; `pressed` on a click. */
export function onPointer(
  frame: Frame,
  moved: (place: Place | null) => void,
  pressed?: (place: Place) => void,
): void {
  const cover = svg("rect", {
    class: pressed === undefined ? "cover" : "cover pressable",
    x: frame.left,
    y: frame.top,
    width: frame.width,
    height: frame.height,
  });
  const placeOf = (event: PointerEvent | MouseEvent): Place => {
    const box = frame.svg.getBoundingClientRect();
    const zoom = frame.svg.viewBox.baseVal.width / box.width;
    return {
      x: frame.x.value((event.clientX - box.left) * zoom),
      y: frame.y.value((event.clientY - box.top) * zoom),
    };
  };
  cover.addEventListener("pointermove", (event) => moved(placeOf(event)));
  cover.addEventListener("pointerleave", () => moved(null));
  // A finger that taps does not move, and has left before the click comes: what it shows then stays.
  cover.addEventListener("click", (event) => {
    moved(placeOf(event));
    pressed?.(placeOf(event));
  });
  frame.svg.append(cover);
}
