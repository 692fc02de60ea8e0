/** What the reader should be warned of. */

import { type Child, el } from "../dom";
import type { WarningsSection } from "../page";
import { rich } from "../symbols";

export function drawWarnings(section: WarningsSection, body: HTMLElement): void {
  if (section.items.length === 0) {
    if (section.note === null) body.append(el("p", { class: "calm" }, "None."));
    return;
  }
  body.append(el("ul", { class: "warnings" }, ...section.items.map((item) => el("li", {}, ...named(item)))));
}

/** Returns a warning with the names between its backquotes set as code. */
function named(text: string): Child[] {
  const parts = text.split("`");
  // A backquote without its partner is a character like any other.
  if (parts.length % 2 === 0) return rich(text);
  return parts.flatMap((part, index) => (index % 2 === 0 ? rich(part) : [el("code", {}, part)]));
}
