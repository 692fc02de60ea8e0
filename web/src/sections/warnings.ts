/** What the reader should be warned of. */

import { el } from "../dom";
import type { WarningsSection } from "../page";
import { rich } from "../symbols";

export function drawWarnings(section: WarningsSection, body: HTMLElement): void {
  if (section.items.length === 0) {
    if (section.note === null) body.append(el("p", { class: "calm" }, "None."));
    return;
  }
  body.append(el("ul", { class: "warnings" }, ...section.items.map((item) => el("li", {}, ...rich(item)))));
}
