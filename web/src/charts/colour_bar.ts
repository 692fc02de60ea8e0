/** A slim colour bar at the right of a plot. */

import { type ColourScale, gradient } from "../colours";
import { freshId, svg } from "../dom";
import { richSvg } from "../symbols";
import type { Display } from "../units";
import type { Frame } from "./frame";
import { LETTER, LINE, ticksOf, twoLines } from "./frame";

/** Room that a colour bar needs at the right of a frame [px]. */
export const BAR_ROOM = 84;
const WIDTH = 13;
const GAP = 12;

export interface BarOptions {
  readonly scale: ColourScale;
  readonly label: string;
  readonly display: Display;
  /** Lines across the bar, such as a noise floor. */
  readonly marks?: readonly { readonly at: number; readonly label: string }[];
}

export function drawColourBar(frame: Frame, options: BarOptions): void {
  const { scale } = options;
  const left = frame.left + frame.width + GAP;
  const y = (value: number): number => frame.top + frame.height * (1 - scale.position(value));
  const id = freshId("bar");
  frame.defs.append(gradient(scale, id));
  const group = svg("g", { class: "axis colour-bar", "aria-hidden": "true" });
  const box = { x: left, y: frame.top, width: WIDTH, height: frame.height };
  group.append(svg("rect", { ...box, fill: `url(#${id})` }), svg("rect", { ...box, class: "frame" }));
  const axis = { domain: [scale.low, scale.high] as const, label: "", display: options.display };
  let last = Infinity;
  let widest = 0;
  for (const tick of ticksOf(axis, frame.height / 46)) {
    const place = y(tick.at);
    // A scale with a power puts its high ticks close together.
    if (Math.abs(last - place) < 13) continue;
    last = place;
    widest = Math.max(widest, tick.text.length);
    group.append(
      svg("line", { x1: left + WIDTH, x2: left + WIDTH + 4, y1: place, y2: place }),
      svg("text", { x: left + WIDTH + 7, y: place + 4 }, tick.text),
    );
  }
  for (const mark of options.marks ?? []) {
    const place = y(mark.at);
    const ends = { x1: left - 2, x2: left + WIDTH + 2, y1: place, y2: place };
    group.append(
      svg("line", { ...ends, class: "bar-mark-edge" }),
      svg("line", { ...ends, class: "bar-mark" }, svg("title", {}, mark.label)),
    );
  }
  const middle = frame.top + frame.height / 2;
  const right = left + WIDTH + 7 + widest * LETTER + 17;
  // The label is centred on the bar: it may reach as far down as there is room above.
  twoLines(options.label, frame.height + 2 * frame.top).forEach((line, index) => {
    const turned = `translate(${right + index * LINE} ${middle}) rotate(-90)`;
    group.append(
      svg("text", { class: "label", transform: turned, "text-anchor": "middle" }, ...richSvg(line)),
    );
  });
  frame.svg.append(group);
}
