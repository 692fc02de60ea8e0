/** A page that is complete: its sections one below the other. */

import type { Context } from "../context";
import type { Page } from "../page";
import { fillSection, sectionFrame } from "../sections/draw";
import { type Shell, makeShell } from "../shell";
import { arrange } from "./order";

export async function showReport(page: Page): Promise<void> {
  const shell = makeShell(page);
  await drawSections(shell, page, { memory: new Map(), fetchCell: null, send: null });
}

/** Draws all sections of a page into its shell. */
export async function drawSections(shell: Shell, page: Page, context: Context): Promise<void> {
  shell.showState(page.state);
  shell.showContents(page.sections);
  const frames = page.sections.map(sectionFrame);
  shell.main.replaceChildren(...frames);
  arrange(shell.main, page.sections);
  for (const [index, section] of page.sections.entries()) {
    const frame = frames[index];
    if (frame !== undefined) await fillSection(frame, section, context);
  }
}
