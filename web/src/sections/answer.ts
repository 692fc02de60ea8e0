/** The answer of a run: next to its words one picture of the result, below them what to do next. */

import { nullable, list, object, text, withDefault } from "../check";
import type { Context } from "../context";
import { el } from "../dom";
import type { RawSection } from "../page";
import { rich } from "../symbols";
import { fillSection } from "./draw";

const more = object({ picture: nullable(text), next: withDefault(list(text), []) });

/** A longer legend is for the chapter: here it would take more room than its picture. */
const MOST_NAMED = 6;

export async function drawAnswer(
  frame: HTMLElement,
  section: RawSection,
  all: readonly RawSection[],
  context: Context,
): Promise<void> {
  if (section.kind !== "summary") return;
  const { picture, next } = more(section.content, "");
  const body = frame.querySelector(":scope > .body");
  if (next.length > 0) body?.append(el("div", { class: "next" }, el("h3", {}, "What to do next"), ...next.map(step)));
  const shown = all.find((one) => one.id === picture);
  if (shown === undefined) return;
  frame.classList.add("answer");
  const room = el("div", { class: "answer-room" });
  frame.append(room);
  await fillSection(room, shown, { ...context, memory: new Map() });
  const drawing = room.querySelector<SVGSVGElement>("svg[role=img]");
  const legend = room.querySelector(".legend");
  const named = legend !== null && legend.childElementCount <= MOST_NAMED ? legend : null;
  room.remove();
  if (drawing === null) return;
  // A picture and no more: to point and to click is for the chapter.
  drawing.removeAttribute("tabindex");
  const caption = el("figcaption", {}, el("a", { href: `#${shown.id}` }, ...rich(shown.title)));
  const still = el("div", { inert: true }, drawing, named);
  frame.append(el("figure", { class: "answer-picture" }, still, caption));
}

/** Returns a sentence with the command between its backquotes. */
function step(words: string): HTMLElement {
  const [before = "", command = "", after = ""] = words.split("`");
  return el("p", {}, ...rich(before), command !== "" && el("code", { tabindex: 0 }, command), ...rich(after));
}
