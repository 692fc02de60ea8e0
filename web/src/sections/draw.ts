/** Draws a section of any kind; a fault in one section never takes the others with it. */

import { PageError } from "../check";
import type { Context } from "../context";
import { el } from "../dom";
import { type Kind, type RawSection, SECTIONS, type SectionOf } from "../page";
import { rich } from "../symbols";
import { drawBiplot } from "./biplot";
import { drawChosenTimes } from "./chosen_times";
import { drawClassGraph } from "./class_graph";
import { drawClassTimes } from "./class_times";
import { drawClasses } from "./classes";
import { drawEmpty } from "./empty";
import { drawFlow } from "./flow";
import { drawImageGrid } from "./image_grid";
import { drawL1Map } from "./l1_map";
import { drawLines } from "./lines";
import { drawManifest } from "./manifest";
import { drawMap } from "./map";
import { drawReplay } from "./replay";
import { drawSummary } from "./summary";
import { drawTable } from "./table";
import { drawTrajectory } from "./trajectory";
import { drawWarnings } from "./warnings";

type Draw<K extends Kind> = (
  section: SectionOf<K>,
  body: HTMLElement,
  context: Context,
) => void | Promise<void>;

const DRAWERS: Partial<{ [K in Kind]: Draw<K> }> = {
  summary: drawSummary,
  warnings: drawWarnings,
  trajectory: drawTrajectory,
  flow: drawFlow,
  map: drawMap,
  lines: drawLines,
  image_grid: drawImageGrid,
  classes: drawClasses,
  class_times: drawClassTimes,
  l1_map: drawL1Map,
  setting_times: drawChosenTimes,
  biplot: drawBiplot,
  class_graph: drawClassGraph,
  replay: drawReplay,
  table: drawTable,
  manifest: drawManifest,
  empty: drawEmpty,
};

/** Returns the empty frame of a section; `fillSection` draws into it once it is in the document. */
export function sectionFrame(section: RawSection, level: 2 | 3 = 2): HTMLElement {
  const heading = `heading-${section.id}`;
  return el(
    "section",
    { id: section.id, class: "section", "data-kind": section.kind, "aria-labelledby": heading },
    el(`h${level}`, { id: heading, class: "title", tabindex: -1 }, ...rich(section.title)),
    el("div", { class: "body" }),
  );
}

export async function fillSection(frame: HTMLElement, section: RawSection, context: Context): Promise<void> {
  // Drawn out of sight first, so that what is there stays until the new picture is complete.
  const body = el("div", { class: "body drawing" });
  const before = frame.querySelector(":scope > .body");
  frame.append(body);
  try {
    await drawBody(section, body, context);
  } catch (error) {
    body.replaceChildren(el("p", { class: "fault", role: "alert" }, faultText(error)));
    if (!(error instanceof PageError)) console.error(error);
  }
  const focused = before === null ? -1 : focusable(before).indexOf(document.activeElement as HTMLElement);
  before?.replaceWith(body);
  body.classList.remove("drawing");
  if (focused >= 0) focusable(body)[focused]?.focus({ preventScroll: true });
  frame.querySelector(":scope > .note")?.remove();
  if (section.note !== null && section.note !== "") {
    frame.append(el("p", { class: "note" }, ...rich(section.note)));
  }
}

function focusable(body: Element): HTMLElement[] {
  return [...body.querySelectorAll<HTMLElement>("[tabindex], button, select, input, summary")];
}

async function drawBody(section: RawSection, body: HTMLElement, context: Context): Promise<void> {
  if (!isKind(section.kind)) {
    throw new PageError(`sections of kind '${section.kind}' are not known to this version of driftwalk`);
  }
  await drawKind(section.kind, section.content, body, context);
}

function isKind(kind: string): kind is Kind {
  return Object.hasOwn(SECTIONS, kind);
}

async function drawKind<K extends Kind>(
  kind: K,
  content: unknown,
  body: HTMLElement,
  context: Context,
): Promise<void> {
  const draw: Draw<K> | undefined = DRAWERS[kind];
  const section = SECTIONS[kind](content, "") as SectionOf<K>;
  await draw?.(section, body, context);
}

function faultText(error: unknown): string {
  const words = error instanceof Error ? error.message : String(error);
  return `This part cannot be shown: ${words}`;
}
