/** Nothing to show, and why. */

import { el } from "../dom";
import type { EmptySection } from "../page";

export function drawEmpty(section: EmptySection, body: HTMLElement): void {
  body.append(el("p", { class: "nothing" }, section.reason));
}
