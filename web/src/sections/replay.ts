/** Sample runs of an assembly, to be played. */

import { type Grid, at, decode, lastUpTo } from "../arrays";
import { figure } from "../charts/responsive";
import { classLegend } from "../class_legend";
import type { ClassColours } from "../colours";
import { type Context, classColours, remembered } from "../context";
import { el, svg } from "../dom";
import { moveSample } from "../keyboard";
import type { ReplaySection } from "../page";
import { TankCanvas, assemblyColours } from "../tank/canvas";
import { boxAround } from "../tank/outline";
import { onThemeChange } from "../theme";
import { fixed } from "../units";

/** Poses of one run, each of shape (time, block). */
interface Run {
  readonly name: string;
  readonly blocks: number;
  readonly x: Float64Array;
  readonly y: Float64Array;
  readonly theta: Float64Array;
  readonly assembly: Float64Array;
  readonly events: ReplaySection["runs"][number]["events"];
  readonly classes: ReplaySection["runs"][number]["classes"];
}

const SPEEDS = [0.5, 1, 2, 5, 10, 20] as const;

export async function drawReplay(section: ReplaySection, body: HTMLElement, context: Context): Promise<void> {
  const time = (await decode(section.time)).data;
  const runs = await Promise.all(section.runs.map((run) => decodeRun(run, time.length)));
  const kept = remembered(context, `replay ${section.id}`, () => ({ run: 0, speed: 5 }));
  const first = runs[kept.run] ?? runs[0];
  if (first === undefined || time.length === 0) {
    body.append(el("p", { class: "nothing" }, "No run was kept."));
    return;
  }
  new Player(section, body, time, runs, first, kept, classColours(context));
}

/** Returns poses by time and block, whichever of the two is stored first. */
async function decodeRun(source: ReplaySection["runs"][number], times: number): Promise<Run> {
  const grids = await Promise.all([source.x, source.y, source.theta, source.assembly].map(decode));
  const [x, y, theta, assembly] = grids.map((grid) => timesFirst(grid, times));
  const first = grids[0];
  const blocks = first === undefined || times === 0 ? 0 : first.data.length / times;
  const none = new Float64Array();
  return {
    name: source.name,
    blocks,
    x: x ?? none,
    y: y ?? none,
    theta: theta ?? none,
    assembly: assembly ?? none,
    events: source.events,
    classes: source.classes,
  };
}

function timesFirst(grid: Grid, times: number): Float64Array {
  const [rows = 0, columns = 0] = grid.shape;
  if (columns !== times) return grid.data;
  const turned = new Float64Array(grid.data.length);
  grid.data.forEach((value, index) => {
    turned[(index % columns) * rows + Math.floor(index / columns)] = value;
  });
  return turned;
}

class Player {
  private readonly tank: TankCanvas;
  private readonly root: HTMLElement;
  private readonly button = el("button", { type: "button", class: "play", "aria-label": "Play" }, "Play");
  private readonly slider: HTMLInputElement;
  private readonly clock = el("output", { class: "clock" });
  private readonly outcome = el("p", { class: "readout", "aria-live": "polite" });
  private readonly playhead = svg("line", { class: "playhead" });
  private strip: { redraw(): void } | null = null;
  private stripScale: (time: number) => number = () => 0;
  private sample = 0;
  private playing = false;
  /** Moment that is shown while playing [s]; between two samples too. */
  private moment = 0;
  private lastFrame = 0;

  constructor(
    section: ReplaySection,
    body: HTMLElement,
    private readonly time: Float64Array,
    private readonly runs: readonly Run[],
    private run: Run,
    private readonly kept: { run: number; speed: number },
    private readonly colours: ClassColours,
  ) {
    this.slider = el("input", {
      type: "range",
      min: 0,
      max: time.length - 1,
      step: 1,
      value: 0,
      "aria-label": "Time",
    });
    const canvas = el("div", { class: "replay-tank" });
    const beside = el("div", { class: "replay-side" });
    this.root = el("div", { class: "replay", "data-part": "replay" }, canvas, beside);
    body.append(this.root);
    this.tank = new TankCanvas(canvas, "Blocks in the tank, coloured by assembly");
    const box = boxAround(section.arena, this.run.x, this.run.y);
    this.tank.setTank(section.arena, [section.side, section.width], box);
    beside.append(this.controls(), this.outcome);
    this.addStrip(beside, section.cells);
    this.useKeys(canvas);
    onThemeChange(() => this.root.isConnected && this.show(this.sample));
    this.show(0);
  }

  private controls(): HTMLElement {
    const runChoice = el("select", { "aria-label": "Run" });
    this.runs.forEach((run, index) => runChoice.append(el("option", { value: index }, run.name)));
    runChoice.value = String(this.kept.run);
    runChoice.addEventListener("change", () => {
      this.kept.run = Number(runChoice.value);
      this.run = this.runs[this.kept.run] ?? this.run;
      this.strip?.redraw();
      this.show(0);
    });
    const speedChoice = el("select", { "aria-label": "Speed" });
    for (const speed of SPEEDS) speedChoice.append(el("option", { value: speed }, `${speed} × real time`));
    speedChoice.value = String(this.kept.speed);
    speedChoice.addEventListener("change", () => {
      this.kept.speed = Number(speedChoice.value);
    });
    this.button.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => this.show(Number(this.slider.value)));
    return el(
      "div",
      { class: "controls" },
      el("div", { class: "row" }, runChoice, speedChoice),
      el("div", { class: "row" }, this.button, this.slider, this.clock),
    );
  }

  private useKeys(element: HTMLElement): void {
    element.tabIndex = 0;
    element.setAttribute("role", "application");
    element.setAttribute("aria-label", "Replay: space plays and pauses, arrow keys move in time");
    element.addEventListener("keydown", (event) => {
      if (event.key === " ") this.toggle();
      else {
        const next = moveSample(this.sample, event.key, this.time.length);
        if (next === null) return;
        this.show(next);
      }
      event.preventDefault();
    });
  }

  private toggle(): void {
    this.playing = !this.playing;
    if (this.playing && this.sample >= this.time.length - 1) this.show(0);
    this.root.dataset["playing"] = this.playing ? "yes" : "no";
    this.button.textContent = this.playing ? "Pause" : "Play";
    this.button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    if (!this.playing) return;
    this.lastFrame = performance.now();
    requestAnimationFrame((now) => this.step(now));
  }

  private step(now: number): void {
    if (!this.playing || !this.root.isConnected) return;
    this.moment += (Math.max(0, now - this.lastFrame) / 1000) * this.kept.speed;
    this.lastFrame = now;
    const next = lastUpTo(this.time, this.moment);
    if (next !== this.sample) this.draw(next);
    if (next >= this.time.length - 1) this.toggle();
    else requestAnimationFrame((later) => this.step(later));
  }

  private show(sample: number): void {
    this.moment = at(this.time, sample);
    this.draw(sample);
  }

  private draw(sample: number): void {
    this.sample = sample;
    const { run } = this;
    const of = (values: Float64Array): Float64Array =>
      values.subarray(sample * run.blocks, (sample + 1) * run.blocks);
    this.tank.draw({
      blocks: {
        x: of(run.x),
        y: of(run.y),
        theta: of(run.theta),
        colours: assemblyColours(of(run.assembly)),
      },
    });
    const now = at(this.time, sample);
    const end = at(this.time, this.time.length - 1);
    this.slider.value = String(sample);
    this.clock.textContent = `${fixed(now, 1)} of ${fixed(end, 0)} s`;
    const last = run.classes.findLast((change) => change.time <= now + 1e-9);
    const words = last === undefined ? "" : `Outcome class now: ${last.class}`;
    if (this.outcome.textContent !== words) this.outcome.textContent = words;
    const x = this.stripScale(now);
    this.playhead.setAttribute("x1", String(x));
    this.playhead.setAttribute("x2", String(x));
    Object.assign(this.root.dataset, { sample: String(sample), time: String(now), run: run.name });
  }

  /** Adds a band that shows which class the blocks were when; a click goes there. */
  private addStrip(beside: HTMLElement, cells: ReplaySection["cells"]): void {
    const names = [...new Set(this.runs.flatMap((run) => run.classes.map((change) => change.class)))];
    if (names.length === 0) return;
    this.strip = figure(beside, "strip", (width) => this.drawStrip(width));
    beside.append(
      classLegend(
        names.map((name) => ({ name, cells: cells.get(name) ?? [], colour: this.colours.of(name) })),
      ),
      el(
        "p",
        { class: "note" },
        "Band: outcome class over time; the line is now. Blocks of one colour are joined, grey ones are alone.",
      ),
    );
  }

  private drawStrip(width: number): SVGSVGElement {
    const [start, end] = [at(this.time, 0), at(this.time, this.time.length - 1)];
    this.stripScale = (time) => ((time - start) / (end - start || 1)) * width;
    const words = this.run.classes
      .map((change) => `${change.class} from ${fixed(change.time, 1)} s`)
      .join(", ");
    const picture = svg("svg", {
      class: "plot",
      viewBox: `0 0 ${width} 34`,
      width,
      height: 34,
      role: "img",
      "aria-label": words,
    });
    this.run.classes.forEach((change, index) => {
      const from = this.stripScale(Math.max(start, change.time));
      const to = this.stripScale(this.run.classes[index + 1]?.time ?? end);
      const piece = svg(
        "rect",
        { x: from, y: 5, width: Math.max(0, to - from), height: 24 },
        svg("title", {}, change.class),
      );
      piece.style.setProperty("fill", this.colours.of(change.class));
      picture.append(piece);
    });
    this.playhead.setAttribute("y1", "1");
    this.playhead.setAttribute("y2", "33");
    picture.append(this.playhead);
    picture.addEventListener("click", (event) => {
      const box = picture.getBoundingClientRect();
      const moment = start + ((event.clientX - box.left) / box.width) * (end - start);
      this.show(lastUpTo(this.time, moment));
    });
    const x = this.stripScale(at(this.time, this.sample));
    this.playhead.setAttribute("x1", String(x));
    this.playhead.setAttribute("x2", String(x));
    return picture;
  }
}
