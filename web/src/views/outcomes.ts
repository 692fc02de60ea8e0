/** How often the tank as it is set assembles into what: runs in a worker, counted as they end. */

import { el } from "../dom";
import { nullable, number, object, record } from "../check";
import type { RawSection } from "../page";
import { cellsOfShape, type Square } from "../polyomino";
import { isComplete } from "../colours";
import { drawClasses } from "../sections/classes";
import { duration, percent } from "../units";
import type { Link, Message } from "./socket";

const RUNS = 200;
/** Classes that are drawn; of more, the most frequent. */
const MOST = 12;
const CHANGED = " The settings have changed since then.";
const LONGEST_SKETCH = 16;
/** Quantile of the normal law for intervals of 90 %. */
const Z = 1.645;

const countsMessage = object({
  counts: record(number),
  done: number,
  runs: number,
  complete: number,
  median_s: nullable(number),
});

export class OutcomesPanel {
  private outdated = false;
  private readonly body = el("div", {});
  private readonly words = el("p", { class: "note", role: "status" });
  private readonly button = el("button", { type: "button", "data-action": "count" }, `Simulate ${RUNS} runs`);

  constructor(root: HTMLElement, section: RawSection, link: Link) {
    this.button.addEventListener("click", () => {
      this.words.textContent = "The first runs are on their way.";
      this.outdated = false;
      link.send({ type: "count", runs: RUNS });
    });
    root.append(el("h2", {}, section.title), el("div", { class: "actions" }, this.button), this.words, this.body);
    if (section.note !== null) root.append(el("p", { class: "note" }, section.note));
  }

  /** A setting has changed: the runs were with those before. */
  outdate(): void {
    if (this.outdated || this.body.childElementCount === 0) return;
    this.outdated = true;
    this.words.append(CHANGED);
  }

  show(content: Message): void {
    const { counts, done, runs, complete, median_s: median } = countsMessage(content, "");
    const sorted = [...counts].sort(([, one], [, other]) => other - one);
    const shown = sorted.slice(0, MOST).sort(([one], [other]) => Number(isComplete(other)) - Number(isComplete(one)));
    const items = shown.map(([name, count]) => ({
      class: name,
      cells: sketchOf(name),
      count,
      ...interval(count, done),
      note: null,
    }));
    const rest = sorted.slice(MOST).reduce((sum, [, count]) => sum + count, 0);
    const others = rest > 0 ? `; ${rest} runs ended in ${sorted.length - MOST} other classes` : "";
    const half = median === null ? "" : `, half of all within ${duration(median)}`;
    this.words.textContent = [
      `${done} of ${runs} runs${others}.`,
      `One assembly in ${percent(complete)}${half}.`,
      "Whiskers: 90 % intervals, one class at a time.",
    ].join(" ");
    const frame = { id: "outcomes", kind: "classes", title: "", note: null, confidence: 0.9, runs: done };
    if (this.outdated) this.words.append(CHANGED);
    // The table stays open, and under the keys, while the counts go on.
    const table = this.body.querySelector("details");
    const isOpen = table?.open ?? false;
    const isFocused = table?.contains(document.activeElement) ?? false;
    this.body.replaceChildren();
    drawClasses({ ...frame, series: [{ name: "runs", items }] }, this.body);
    const renewed = this.body.querySelector("details");
    if (renewed !== null) renewed.open = isOpen;
    if (isFocused) renewed?.querySelector("summary")?.focus();
    this.body.dataset["done"] = String(done);
    this.body.dataset["counts"] = JSON.stringify(Object.fromEntries(sorted));
  }
}

/** Returns a share with Wilson's interval. */
function interval(count: number, runs: number): { share: number; low: number; high: number } {
  const share = count / runs;
  const middle = (share + Z ** 2 / (2 * runs)) / (1 + Z ** 2 / runs);
  const reach = (Z * Math.sqrt((share * (1 - share)) / runs + Z ** 2 / (4 * runs ** 2))) / (1 + Z ** 2 / runs);
  return { share, low: middle - reach, high: middle + reach };
}

/** Returns the shapes of a class in a row; nothing of a class that is too long for it, or has one without cells. */
function sketchOf(name: string): Square[] {
  const cells: Square[] = [];
  let left = 0;
  for (const shape of name.split("+")) {
    const own = cellsOfShape(shape);
    if (own.length === 0) return [];
    cells.push(...own.map(([x, y]): Square => [x + left, y]));
    left = Math.max(left, ...cells.map(([x]) => x + 2));
  }
  return left <= LONGEST_SKETCH ? cells : [];
}
