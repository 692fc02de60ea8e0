/** A page that is complete: by chapters where it has any, else its sections one below the other. */

import type { Context } from "../context";
import type { Page } from "../page";
import { fillSection, sectionFrame } from "../sections/draw";
import { type Shell, makeShell } from "../shell";
import { drawChapters } from "./chapters";
import { arrange } from "./order";

export async function showReport(page: Page): Promise<void> {
  const shell = makeShell(page);
  const chapters = page.sections.some((section) => section.chapter !== null);
  const draw = chapters ? drawChapters : drawSections;
  await draw(shell, page, { memory: new Map(), fetchCell: null, send: null });
}

/** Draws all sections of a page into its shell. */
export async function drawSections(shell: Shell, page: Page, context: Context): Promise<void> {
  shell.showState(page.state);
  shell.showContents(page.sections);
  const frames = page.sections.map((section) => sectionFrame(section));
  shell.main.replaceChildren(...frames);
  arrange(shell.main, page.sections);
  for (const [index, section] of page.sections.entries()) {
    const frame = frames[index];
    if (frame !== undefined) await fillSection(frame, section, context);
  }
}
