/** The order of the sections of a page that changes. */

import type { RawSection } from "../page";

/** Returns whether both are the same sections in the same order. */
export function sameIds(one: readonly RawSection[], other: readonly RawSection[]): boolean {
  return one.length === other.length && one.every((section, index) => section.id === other[index]?.id);
}

/** Returns the sections with a new one behind the one that it names, else at the end. */
export function insertAfter(sections: readonly RawSection[], section: RawSection): RawSection[] {
  const content = section.content;
  const after = typeof content === "object" && content !== null && "after" in content ? content.after : null;
  const place = sections.findIndex((one) => one.id === after);
  return place < 0 ? [...sections, section] : sections.toSpliced(place + 1, 0, section);
}

/** Kinds of sections that need only half of a wide page. */
const SMALL: ReadonlySet<string> = new Set(["lines", "image_grid", "biplot", "table"]);

/** Returns which sections stand beside another: small ones, in pairs. */
export function besides(kinds: readonly string[]): boolean[] {
  const beside = kinds.map(() => false);
  for (let index = 0; index + 1 < kinds.length; index += 1) {
    if (!SMALL.has(kinds[index] ?? "") || !SMALL.has(kinds[index + 1] ?? "")) continue;
    beside[index] = beside[index + 1] = true;
    index += 1;
  }
  return beside;
}

/** Puts small sections side by side. */
export function arrange(main: HTMLElement): void {
  const frames = [...main.children];
  const beside = besides(frames.map((frame) => frame.getAttribute("data-kind") ?? ""));
  frames.forEach((frame, index) => frame.classList.toggle("beside", beside[index] ?? false));
}
