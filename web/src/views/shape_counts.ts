/** How many assemblies of each shape there are, over time. */

import { makeFrame } from "../charts/frame";
import { linePath } from "../charts/paths";
import { type Figure, figure } from "../charts/responsive";
import { PALETTE } from "../colours";
import { el, svg } from "../dom";
import { linearTicks } from "../scale";
import { styleColour } from "../theme";
import { cellsOfShape, sketchPicture, writtenName } from "../polyomino";

const KNOWN = ["2", "I3", "L3", "I", "O", "T", "S", "L", "Z", "J"];
const MOST_CHANGES = 4000;
const MOST_LINES = 7;
const DRAW_EVERY_MS = 400;

/** Returns the colour of a shape; one block alone is grey. */
export function shapeColour(name: string): string {
  if (name === "1") return styleColour("block");
  const place = KNOWN.indexOf(name);
  const index = place >= 0 ? place : [...name].reduce((sum, letter) => sum + letter.charCodeAt(0), 0);
  return PALETTE[index % PALETTE.length] ?? PALETTE[0];
}

export class ShapeCounts {
  /** Moments at which the counts changed; a level reaches to the next. */
  private readonly times: number[] = [];
  private readonly counts: ReadonlyMap<string, number>[] = [];
  private until = 0;
  private readonly legend = el("ul", { class: "legend class-legend" });
  private readonly chart: Figure;
  private drawn = 0;

  constructor(parent: HTMLElement) {
    this.chart = figure(parent, "", (width) => this.draw(width));
    parent.append(this.legend);
  }

  clear(): void {
    this.times.length = 0;
    this.counts.length = 0;
    this.show();
  }

  /** Takes how many assemblies of each shape there are at a moment. */
  add(time: number, counts: ReadonlyMap<string, number>): void {
    if (time < (this.times.at(-1) ?? -Infinity)) this.clear();
    const last = this.counts.at(-1);
    this.until = time;
    if (last === undefined || !isSame(last, counts)) {
      this.times.push(time);
      this.counts.push(counts);
      if (this.times.length > MOST_CHANGES) {
        this.times.shift();
        this.counts.shift();
      }
    }
    if (performance.now() - this.drawn > DRAW_EVERY_MS) this.show();
  }

  private show(): void {
    this.drawn = performance.now();
    this.chart.redraw();
    const names = this.names();
    if (this.legend.dataset["names"] === names.join(" ")) return;
    this.legend.dataset["names"] = names.join(" ");
    this.legend.replaceChildren(
      ...names.map((name) =>
        el(
          "li",
          {},
          sketchPicture(cellsOfShape(name), 7, shapeColour(name)),
          el("span", {}, writtenName(name)),
        ),
      ),
    );
  }

  /** Returns the shapes that have a line of their own: the most frequent, the small ones first. */
  private names(): string[] {
    const total = new Map<string, number>();
    for (const [name, count] of this.counts.flatMap((counts) => [...counts]))
      total.set(name, (total.get(name) ?? 0) + count);
    const frequent = [...total].sort(([, one], [, other]) => other - one).slice(0, MOST_LINES);
    return frequent.map(([name]) => name).sort((one, other) => order(one) - order(other));
  }

  private draw(width: number): Element {
    const start = this.times[0];
    if (start === undefined) return el("p", { class: "nothing" }, "Nothing has been counted yet.");
    const names = this.names();
    const top = Math.max(1, ...this.counts.flatMap((counts) => [...counts.values()]));
    const end = Math.max(this.until, start + 1);
    const now = names.map((name) => `${this.counts.at(-1)?.get(name) ?? 0} ${name}`);
    const frame = makeFrame({
      width,
      height: 130,
      x: { domain: [start, end], label: "time", display: { factor: 1, unit: "s" } },
      // A little room above, so that the highest line does not lie on the frame; whole numbers only.
      y: {
        domain: [0, 1.08 * top],
        label: "assemblies",
        display: { factor: 1, unit: "" },
        ticks: wholeTicks(top),
      },
      grid: "y",
      label: `Assemblies over time: now ${now.join(", ")}`,
    });
    names.forEach((name, index) => {
      const [x, y]: [number[], number[]] = [[], []];
      // Lines of equal counts lie beside each other, not on each other.
      const aside = 1.5 * (index - (names.length - 1) / 2);
      this.times.forEach((time, place) => {
        const level = frame.y.px(this.counts[place]?.get(name) ?? 0) + aside;
        x.push(frame.x.px(time), frame.x.px(this.times[place + 1] ?? end));
        y.push(level, level);
      });
      const line = svg("path", { class: "series", d: linePath(x, y) });
      line.style.setProperty("color", shapeColour(name));
      frame.plot.append(line);
    });
    return frame.svg;
  }
}

function wholeTicks(top: number): { at: number; text: string }[] {
  return linearTicks(0, top, 4)
    .filter(Number.isInteger)
    .map((tick) => ({ at: tick, text: String(tick) }));
}

function isSame(one: ReadonlyMap<string, number>, other: ReadonlyMap<string, number>): boolean {
  return one.size === other.size && [...one].every(([name, count]) => other.get(name) === count);
}

function order(name: string): number {
  const place = name === "1" ? -1 : KNOWN.indexOf(name);
  return place < 0 && name !== "1" ? KNOWN.length + name.length : place;
}
