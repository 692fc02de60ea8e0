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
