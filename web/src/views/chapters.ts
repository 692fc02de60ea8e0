/** A report by chapters: the answer stands open, the rest is folded and drawn when it is opened. */

import type { Context } from "../context";
import { el } from "../dom";
import type { Page, RawSection } from "../page";
import { drawAnswer } from "../sections/answer";
import { fillSection, sectionFrame } from "../sections/draw";
import type { Shell } from "../shell";
import { rich } from "../symbols";
import { arrange } from "./order";

/** Draws a page of which some sections belong to a chapter. */
export async function drawChapters(shell: Shell, page: Page, context: Context): Promise<void> {
  shell.showState(page.state);
  shell.main.replaceChildren();
  const folds: Fold[] = [];
  const links: { id: string; title: string; first?: boolean }[] = [];
  for (const sections of parts(page.sections, (section) => section.run)) {
    const [first] = sections;
    if (first === undefined) continue;
    const run = first.run;
    if (run !== null) {
      const id = `run-${first.id}`;
      shell.main.append(el("h2", { id, class: "run", tabindex: -1 }, ...rich(run)));
      links.push({ id, title: run, first: true });
    }
    for (const chapter of parts(sections, (section) => section.chapter)) {
      const title = chapter[0]?.chapter ?? null;
      if (title === null) {
        for (const section of chapter) {
          if (isCalm(section)) {
            shell.main.lastElementChild?.querySelector(":scope > .body")?.append(
              el("p", { id: section.id, class: "calm" }, `${section.title}: none.`),
            );
            continue;
          }
          const frame = sectionFrame(section);
          shell.main.append(frame);
          links.push(section);
          await fillSection(frame, section, context);
          await drawAnswer(frame, section, page.sections, context);
        }
        continue;
      }
      const fold = new Fold(title, chapter, context);
      shell.main.append(fold.element);
      folds.push(fold);
      links.push({ id: fold.element.id, title });
    }
  }
  shell.showContents(links);
  shell.main.append(openAll(folds));
  const follow = (): Promise<void> => openAt(location.hash.slice(1), folds);
  addEventListener("hashchange", () => void follow());
  addEventListener("beforeprint", () => folds.forEach((fold) => (fold.element.open = true)));
  await follow();
}

/** Returns whether a section says no more than that there is nothing to warn of. */
function isCalm({ kind, content }: RawSection): boolean {
  const items = typeof content === "object" && content !== null && "items" in content ? content.items : null;
  return kind === "warnings" && Array.isArray(items) && items.length === 0;
}

/** Returns what follows each other and has the same key. */
function parts(
  sections: readonly RawSection[],
  key: (section: RawSection) => string | null,
): RawSection[][] {
  const made: RawSection[][] = [];
  for (const section of sections) {
    const last = made.at(-1);
    if (last?.[0] !== undefined && key(last[0]) === key(section)) last.push(section);
    else made.push([section]);
  }
  return made;
}

class Fold {
  readonly element: HTMLDetailsElement;
  private readonly body = el("div", { class: "chapter-body" });
  private drawn: Promise<void> | null = null;

  constructor(
    title: string,
    private readonly sections: readonly RawSection[],
    private readonly context: Context,
  ) {
    const named = sections[0]?.title === title;
    const inside = sections.slice(named ? 1 : 0).map((section) => section.title);
    this.element = el(
      "details",
      { class: "chapter", id: `chapter-${sections[0]?.id ?? title}` },
      el("summary", {}, el("h2", {}, ...rich(title)), el("small", {}, ...rich(inside.join(" · ")))),
      this.body,
    );
    this.body.append(...sections.map((section) => sectionFrame(section, 3)));
    this.body.classList.toggle("named", named);
    arrange(this.body, sections);
    this.element.addEventListener("toggle", () => {
      if (this.element.open) void this.draw();
    });
  }

  /** Opens the chapter; its figures need the width that they have then. */
  async open(): Promise<void> {
    this.element.open = true;
    await this.draw();
  }

  private draw(): Promise<void> {
    this.drawn ??= this.fill();
    return this.drawn;
  }

  private async fill(): Promise<void> {
    for (const [index, section] of this.sections.entries()) {
      const frame = this.body.children[index];
      if (frame instanceof HTMLElement) await fillSection(frame, section, this.context);
    }
  }
}

async function openAt(id: string, folds: readonly Fold[]): Promise<void> {
  const target = id === "" ? null : document.getElementById(decodeURIComponent(id));
  const fold = folds.find(({ element }) => target !== null && element.contains(target));
  await fold?.open();
  target?.scrollIntoView();
}

function openAll(folds: readonly Fold[]): HTMLElement {
  const button = el("button", { type: "button", class: "open-all" }, "Open all chapters");
  button.addEventListener("click", () => {
    void (async (): Promise<void> => {
      for (const fold of folds) await fold.open();
      document.documentElement.dataset["opened"] = "yes";
    })();
  });
  return button;
}
