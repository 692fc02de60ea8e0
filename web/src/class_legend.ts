/** A legend of outcome classes: colour, sketch, name. */

import { el } from "./dom";
import { type Square, sketchPicture, writtenName } from "./polyomino";

export function classLegend(
  classes: readonly { readonly name: string; readonly cells: readonly Square[]; readonly colour: string }[],
): HTMLElement {
  const list = el("ul", { class: "legend class-legend" });
  for (const one of classes) {
    list.append(
      el(
        "li",
        {},
        one.cells.length > 0 ? sketchPicture(one.cells, 7, one.colour) : box(one.colour),
        el("span", {}, writtenName(one.name)),
      ),
    );
  }
  return list;
}

function box(colour: string): HTMLElement {
  const element = el("span", { class: "box" });
  element.style.setProperty("background", colour);
  return element;
}
