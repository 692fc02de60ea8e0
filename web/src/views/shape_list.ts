/** A list of how many assemblies of each shape there are. */

import { el } from "../dom";
import { cellsOfShape, sketchPicture, writtenName } from "../polyomino";

/** Shapes that are listed; of more, the most frequent. */
const MOST = 12;

export class ShapeList {
  readonly element = el("ul", { class: "shapes", "aria-label": "Assemblies by shape" });

  constructor(private readonly colourOf: ((name: string) => string) | null = null) {}

  show(counts: ReadonlyMap<string, number>): void {
    const sorted = [...counts].sort(([, one], [, other]) => other - one);
    const words = sorted.map(([name, count]) => `${count} ${name}`).join(", ");
    if (this.element.dataset["counts"] === words) return;
    this.element.dataset["counts"] = words;
    const rest = sorted.slice(MOST).reduce((sum, [, count]) => sum + count, 0);
    this.element.replaceChildren(
      ...sorted.slice(0, MOST).map(([name, count]) => this.item(name, count)),
      ...(rest > 0 ? [el("li", {}, `${rest} of other shapes`)] : []),
    );
  }

  private item(name: string, count: number): HTMLElement {
    const picture = sketchPicture(cellsOfShape(name), 7, this.colourOf?.(name));
    return el(
      "li",
      { "aria-label": `${count} ${name}` },
      el("b", {}, String(count)),
      picture,
      el("span", { class: "name" }, writtenName(name)),
    );
  }
}
