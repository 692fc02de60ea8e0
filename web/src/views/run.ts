/** A run that is watched: the sections of a report, redrawn as they change. */

import { numbers } from "../arrays";
import { nullable, number, object } from "../check";
import type { CellExcerpt, Context } from "../context";
import { el } from "../dom";
import { type Page, type RawSection, checkOverTime, checkPage, checkSectionHead, checkState } from "../page";
import { fillSection, sectionFrame } from "../sections/draw";
import { type Shell, makeShell } from "../shell";
import { drawSections } from "./report";
import { connected } from "./connection";
import { arrange, insertAfter, sameIds } from "./order";
import type { Message } from "./socket";

const cellMessage = object({
  row: number,
  column: number,
  excerpt_time: nullable(numbers),
  excerpt_x: nullable(numbers),
  excerpt_y: nullable(numbers),
  density: nullable(numbers),
  ks_step_length: nullable(number),
  ks_turning_angle: nullable(number),
  over_time: nullable(checkOverTime),
});

/** Cells that were asked for and have not come yet. */
class Requests {
  private readonly waiting = new Map<
    string,
    { done(cell: CellExcerpt): void; failed(error: Error): void }[]
  >();

  ask(
    id: string,
    row: number,
    column: number,
    send: (message: Record<string, unknown>) => void,
  ): Promise<CellExcerpt> {
    const key = `${id} ${row} ${column}`;
    return new Promise((done, failed) => {
      this.waiting.set(key, [...(this.waiting.get(key) ?? []), { done, failed }]);
      send({ type: "cell", id, row, column });
    });
  }

  answer(message: Message): void {
    const cell = cellMessage(message, "");
    const key = `${String(message["id"])} ${cell.row} ${cell.column}`;
    const excerpt = {
      time: cell.excerpt_time,
      x: cell.excerpt_x,
      y: cell.excerpt_y,
      density: cell.density,
      ksStepLength: cell.ks_step_length,
      ksTurningAngle: cell.ks_turning_angle,
      overTime: cell.over_time,
    };
    for (const one of this.waiting.get(key) ?? []) one.done(excerpt);
    this.waiting.delete(key);
  }

  /** Nobody will answer any more: the connection is lost. */
  fail(): void {
    for (const one of [...this.waiting.values()].flat()) one.failed(new Error("the connection was lost"));
    this.waiting.clear();
  }
}

/** Does one thing after the other, so that two pictures of one section never mix. */
class InTurn {
  private last: Promise<void> = Promise.resolve();

  add(work: () => Promise<void>): void {
    this.last = this.last.then(work).catch((error: unknown) => console.error(error));
  }
}

export function showRun(first: Page): Promise<void> {
  const shell = makeShell(first);
  shell.showState(first.state);
  shell.main.append(el("p", { class: "nothing" }, "Waiting for the server."));
  const requests = new Requests();
  const turn = new InTurn();
  let sections: RawSection[] = [];
  let newest: Page | null = null;
  const changed = new Map<string, RawSection>();

  return new Promise((ready) => {
    const link = connected(shell, first, {
      received: (message) => {
        if (message.type === "page") {
          newest = checkPage(message["page"]);
          changed.clear();
          turn.add(drawPage);
        } else if (message.type === "section") {
          const section = checkSectionHead(message["section"], "section");
          changed.set(section.id, section);
          turn.add(drawChanged);
        } else if (message.type === "state") shell.showState(checkState(message["state"] ?? message));
        else if (message.type === "cell") requests.answer(message);
      },
      lost: () => requests.fail(),
    });
    const context: Context = {
      memory: new Map(),
      fetchCell: (id, row, column) => requests.ask(id, row, column, link.send),
      send: link.send,
    };

    const drawPage = async (): Promise<void> => {
      const page = newest;
      newest = null;
      if (page === null) return;
      shell.showPage(page);
      if (page.state?.finished === true) shell.showSaving(`report.html${location.search}`);
      if (sameIds(sections, page.sections)) {
        shell.showState(page.state);
        for (const section of page.sections) await redraw(shell, section, context);
      } else await drawSections(shell, page, context);
      sections = page.sections;
      ready();
    };
    const drawChanged = async (): Promise<void> => {
      const [id, section] = changed.entries().next().value ?? [];
      if (id === undefined || section === undefined) return;
      changed.delete(id);
      if (sections.some((one) => one.id === id)) await redraw(shell, section, context);
      else {
        sections = insertAfter(sections, section);
        await addSection(shell, sections, section, context);
      }
    };
  });
}

async function redraw(shell: Shell, section: RawSection, context: Context): Promise<void> {
  const frame = [...shell.main.children].find((element) => element.id === section.id);
  if (frame instanceof HTMLElement) await fillSection(frame, section, context);
}

async function addSection(
  shell: Shell,
  all: RawSection[],
  section: RawSection,
  context: Context,
): Promise<void> {
  const frame = sectionFrame(section);
  shell.main.insertBefore(frame, shell.main.children[all.indexOf(section)] ?? null);
  shell.showContents(all);
  arrange(shell.main, all);
  await fillSection(frame, section, context);
}
