/** The playground: a tank that moves while its knobs are turned, and the motion beside a recording. */

import { decode } from "../arrays";
import { list, nullable, number, object, record, text, withDefault, flag } from "../check";
import { el } from "../dom";
import { type ControlsSection, type Page, checkControls, checkPage, checkTank } from "../page";
import { type Shell, makeShell } from "../shell";
import { TankCanvas, assemblyColours } from "../tank/canvas";
import { PALETTE } from "../colours";
import { Trails } from "../tank/trails";
import { onThemeChange } from "../theme";
import { duration, short } from "../units";
import { type Handlers, connected } from "./connection";
import { type Knobs, makeKnobs } from "./controls";
import { DensityPanel } from "./density_panel";
import { connectLocal, localCore, tries } from "./local";
import { newestWins } from "./newest";
import { OutcomesPanel } from "./outcomes";
import { ShapeList } from "./shape_list";
import type { Link, Message } from "./socket";

const tankMessage = object({
  time_s: number,
  speed: nullable(number),
  paused: withDefault(flag, false),
  x: list(number),
  y: list(number),
  theta: list(nullable(number)),
  assembly: list(number),
  poles: withDefault(list(list(number)), []),
  waiting: withDefault(number, 0),
  outcome: nullable(text),
  counts: withDefault(record(number), new Map<string, number>()),
});

type Tank = ReturnType<typeof tankMessage>;

function hue(index: number): string {
  return PALETTE[index % PALETTE.length] ?? "black";
}

export function showPlay(first: Page): Promise<void> {
  const shell = makeShell(first);
  const local = localCore();
  const waits = local === null ? "Waiting for the server." : "Starting the tank.";
  shell.main.append(el("p", { class: "nothing" }, waits));
  return new Promise((ready) => {
    let playground: Playground | null = null;
    const handlers: Handlers = {
      received: (message, link) => {
        if (message.type === "page") {
          const page = checkPage(message["page"]);
          shell.showPage(page);
          playground = new Playground(shell, page, link);
          ready();
        } else playground?.receive(message);
      },
      lost: () => playground?.rest(),
    };
    if (local === null) connected(shell, first, handlers);
    else connectLocal(local, first, handlers);
  });
}

class Playground {
  private readonly tank: TankCanvas;
  private readonly knobs: Knobs | null;
  private readonly density: DensityPanel;
  private readonly outcomes: OutcomesPanel | null;
  private readonly pause = el("button", { type: "button" }, "Pause");
  private readonly clock = el("p", { class: "readout" });
  private readonly shapes = new ShapeList();
  private readonly note = el("p", { class: "fault", role: "status" });
  private readonly take: (state: Tank) => void;
  private readonly set: (wish: { name: string; value: unknown }) => void;
  private last: Tank | null = null;
  private dots = false;
  private trails: Trails | null = null;
  private frames = { count: 0, since: 0, rate: 0 };

  constructor(
    shell: Shell,
    page: Page,
    private readonly link: Link,
  ) {
    const section = (kind: string): unknown => page.sections.find((one) => one.kind === kind)?.content;
    const place = el("div", { class: "play-tank section" });
    const beside = el("div", { class: "play-side" });
    const panel = el("section", { class: "section", "aria-label": "Settings" });
    const motion = el("section", { class: "section", "aria-label": "Motion" });
    beside.append(panel, motion);
    shell.main.replaceChildren(el("div", { class: "playground" }, place, beside));
    shell.showState(null);

    this.tank = new TankCanvas(place, "The tank: blocks of one colour are joined, grey ones are alone");
    place.append(this.clock, this.shapes.element, this.note);
    void this.showTank(section("tank"));
    // A knob sends at most once per picture of the screen; the newest value counts.
    const wishes = new Map<string, (value: unknown) => void>();
    this.set = ({ name, value }) => {
      const send =
        wishes.get(name) ?? newestWins<unknown>((now) => this.link.send({ type: "set", name, value: now }));
      wishes.set(name, send);
      send(value);
    };
    this.knobs = this.addKnobs(panel, section("controls"));
    const density = page.sections.find((one) => one.kind === "density");
    this.density = new DensityPanel(
      motion,
      density?.title ?? "Step length and turning angle",
      density?.note ?? null,
    );
    this.outcomes = this.addOutcomes(beside, page);
    this.take = newestWins((state) => this.draw(state));
    onThemeChange(() => this.last !== null && this.tank.element.isConnected && this.draw(this.last));
  }

  receive(message: Message): void {
    if (message.type === "tank") this.take(tankMessage(message, ""));
    else if (message.type === "density") void this.density.show(message);
    else if (message.type === "counts") this.outcomes?.show(message);
    else if (message.type === "note") this.note.textContent = String(message["words"] ?? "");
    else if (message.type === "section") this.showSection(message["section"]);
  }

  /** The connection is lost: what is shown stands still. */
  rest(): void {
    this.frames = { count: 0, since: 0, rate: 0 };
  }

  private async showTank(content: unknown): Promise<void> {
    if (content === undefined) return;
    const section = checkTank(content, "");
    this.tank.setTank(section.arena, [section.side, section.width]);
    this.dots = section.shape === "dot";
    if (this.dots) this.tank.element.setAttribute("aria-label", "The tank: bodies and their trails");
    this.trails = section.trail_s > 0 ? new Trails(section.trail_s) : null;
    if (section.flow === null) this.tank.setArrows(null);
    else {
      const [x, y, u, v] = await Promise.all(
        [section.flow.x, section.flow.y, section.flow.u, section.flow.v].map(decode),
      );
      if (x === undefined || y === undefined || u === undefined || v === undefined) return;
      const columns = x.data.length;
      this.tank.setArrows({
        x: u.data.map((_, index) => x.data[index % columns] ?? 0),
        y: u.data.map((_, index) => y.data[Math.floor(index / columns)] ?? 0),
        u: u.data,
        v: v.data,
      });
    }
    if (this.last !== null) this.draw(this.last);
  }

  private addKnobs(panel: HTMLElement, content: unknown): Knobs | null {
    if (content === undefined) return null;
    const section: ControlsSection = checkControls(content, "");
    const knobs = makeKnobs(section, (name, value) => {
      this.note.textContent = "";
      this.set({ name, value });
      if (name !== "speed") this.outcomes?.outdate();
    });
    panel.append(el("h2", {}, section.title), this.actions(), knobs.element);
    if (localCore() !== null) panel.append(tries(section.items));
    if (section.note !== null) panel.append(el("p", { class: "note" }, section.note));
    return knobs;
  }

  private addOutcomes(beside: HTMLElement, page: Page): OutcomesPanel | null {
    const section = page.sections.find((one) => one.kind === "outcomes");
    if (section === undefined) return null;
    const panel = el("section", { class: "section", "aria-label": section.title });
    beside.append(panel);
    return new OutcomesPanel(panel, section, this.link);
  }

  private actions(): HTMLElement {
    const act = (name: string) => (): void => this.link.send({ type: "action", name });
    const restart = el("button", { type: "button", "data-action": "restart" }, "Restart");
    restart.addEventListener("click", act("restart"));
    this.pause.addEventListener("click", () => act(this.last?.paused === true ? "run" : "pause")());
    const clear = el("button", { type: "button", "data-action": "clear" }, "Clear the density");
    clear.addEventListener("click", act("clear"));
    return el("div", { class: "actions" }, this.pause, restart, clear, localCore() !== null && this.linkButton());
  }

  private linkButton(): HTMLElement {
    const copy = el("button", { type: "button", "data-action": "link" }, "Copy the link");
    const said = el("span", { class: "note", role: "status" });
    const say = (words: string) => (): void => void (said.textContent = words);
    copy.addEventListener("click", () => {
      const done = navigator.clipboard?.writeText(location.href) ?? Promise.reject(new Error("no clipboard"));
      done.then(say("The link to these settings is copied."), say("The address of this page has these settings."));
    });
    return el("span", {}, copy, " ", said);
  }

  private showSection(content: unknown): void {
    if (typeof content !== "object" || content === null || !("kind" in content)) return;
    if (content.kind === "controls") this.knobs?.update(checkControls(content, ""));
    if (content.kind === "tank") void this.showTank(content);
  }

  private draw(state: Tank): void {
    this.last = state;
    const theta = state.theta.map((angle) => (this.dots || angle === null ? Number.NaN : angle));
    const colours = this.dots ? state.x.map((_, index) => hue(index)) : assemblyColours(state.assembly);
    this.trails?.add(
      state.time_s,
      state.x.map((x, index) => ({ id: String(index), x_m: x, y_m: state.y[index] ?? null })),
    );
    const trails = this.trails?.all().map(({ id, x, y }) => ({ x, y, colour: hue(Number(id)) })) ?? [];
    this.tank.draw({ blocks: { x: state.x, y: state.y, theta, colours, poles: state.poles }, trails });
    this.link.send({ type: "ready" });
    this.countFrame();
    this.pause.textContent = state.paused ? "Run" : "Pause";
    this.pause.dataset["action"] = state.paused ? "run" : "pause";
    this.tank.element.dataset["time"] = String(state.time_s);
    this.tank.element.dataset["blocks"] = String(state.x.length);
    // Words ten times a second are enough, and leave the time to the tank.
    if (this.frames.count % 6 === 1 || state.paused) this.showWords(state);
  }

  private countFrame(): void {
    const now = performance.now();
    if (this.frames.since === 0) this.frames.since = now;
    this.frames.count += 1;
    if (now - this.frames.since < 1000) return;
    this.frames.rate = (1000 * this.frames.count) / (now - this.frames.since);
    this.frames.count = 0;
    this.frames.since = now;
    this.tank.element.dataset["rate"] = this.frames.rate.toFixed(1);
  }

  private showWords(state: Tank): void {
    const speed = state.paused
      ? "paused"
      : state.speed === null
        ? "–"
        : `${short(state.speed, 2)} × real time`;
    const pairs: [string, string][] = [
      ["time", duration(state.time_s)],
      ["speed", speed],
      [this.dots ? "bodies" : "blocks", String(state.x.length)],
    ];
    if (this.frames.rate > 0) pairs.push(["pictures", `${Math.round(this.frames.rate)}/s`]);
    if (state.waiting > 0) pairs.push(["waiting for room", String(state.waiting)]);
    this.clock.replaceChildren(
      ...pairs.map(([name, value]) =>
        el("span", { class: "pair" }, el("span", { class: "name" }, name), " ", el("b", {}, value)),
      ),
    );
    this.shapes.show(state.counts);
  }
}
