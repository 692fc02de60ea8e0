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

/** A wider table does not fit into half of a page: its last columns, often a verdict, would be hidden. */
const MOST_COLUMNS = 3;

/** Returns whether a section needs only half of a wide page. */
export function isSmall({ kind, content }: Pick<RawSection, "kind" | "content">): boolean {
  if (!SMALL.has(kind)) return false;
  const columns =
    typeof content === "object" && content !== null && "columns" in content ? content.columns : [];
  return !Array.isArray(columns) || columns.length <= MOST_COLUMNS;
}

/** Returns which sections stand beside another: small ones, in pairs. */
export function besides(small: readonly boolean[]): boolean[] {
  const beside = small.map(() => false);
  for (let index = 0; index + 1 < small.length; index += 1) {
    if (small[index] !== true || small[index + 1] !== true) continue;
    beside[index] = beside[index + 1] = true;
    index += 1;
  }
  return beside;
}

/** Puts small sections side by side; the frames in `main` are those of the sections. */
export function arrange(main: HTMLElement, sections: readonly RawSection[]): void {
  const beside = besides(sections.map(isSmall));
  [...main.children].forEach((frame, index) => frame.classList.toggle("beside", beside[index] ?? false));
}
