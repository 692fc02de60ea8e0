/** A tracker's stream: blocks in the tank, over the video when wanted, and what they make. */

import { PageError } from "../check";
import { el } from "../dom";
import type { Page } from "../page";
import { facts } from "../parts";
import { type Shell, makeShell } from "../shell";
import { TankCanvas, type Trail, type View } from "../tank/canvas";
import { assemblies, shapeName } from "../tank/joined";
import { boxAround } from "../tank/outline";
import { Trails } from "../tank/trails";
import { type Camera, drawVideo, imageBox } from "../tank/video";
import { onThemeChange } from "../theme";
import { duration, fixed, quantity, whole } from "../units";
import { checkPage } from "../page";
import { connected } from "./connection";
import { HeldFrame } from "./held";
import { type Frame, type Hello, type LiveEvent, UNKNOWN, checkFrame, checkHello } from "./live_message";
import { ShapeCounts, shapeColour } from "./shape_counts";
import { newestWins } from "./newest";
import { ShapeList } from "./shape_list";
import type { Link, Message } from "./socket";

const VIDEO_WIDTH = 640;
/** How far back a trail goes [s], and how many events are listed. */
const TRAIL_S = 10;
const MOST_EVENTS = 200;
/** Time after which frames are drawn over an old picture [ms]: no newer one has come. */
const PICTURE_MS = 1000;
/** Letters of an outcome class that is written out. */
const LONGEST_OUTCOME = 24;

export function showLive(first: Page): Promise<void> {
  const shell = makeShell(first);
  return new Promise((ready) => {
    const stream = new LiveStream(shell);
    connected(shell, first, {
      opened: (link) => stream.opened(link),
      received: (message) => {
        if (message.type === "page") shell.showPage(checkPage(message["page"]));
        stream.receive(message);
        ready();
      },
    });
  });
}

class LiveStream {
  private readonly tank: TankCanvas;
  private readonly status = el("p", { class: "readout", role: "status" });
  private readonly leftOut = el("p", { class: "fault", role: "status" });
  private readonly outcome = el("p", { class: "outcome", "aria-live": "polite" });
  private readonly numbers = el("div");
  private readonly shapes = new ShapeList(shapeColour);
  private readonly list = el("ol", { class: "events", reversed: true });
  private readonly counts: ShapeCounts;
  private readonly video = el("input", { type: "checkbox", name: "video" });
  private readonly trails = el("input", { type: "checkbox", name: "trails" });
  private readonly take: (frame: Frame) => void;
  private readonly held = new HeldFrame<Frame>((frame) => this.take(frame));
  private readonly past = new Trails(TRAIL_S);
  private readonly seenEvents = new Set<string>();
  private link: Link | null = null;
  private hello: Hello | null = null;
  private camera: Camera | null = null;
  private picture: HTMLImageElement | null = null;
  private pictured = 0;
  private last: Frame | null = null;

  constructor(shell: Shell) {
    const place = el("div", { class: "section live-tank" });
    const beside = el("div", { class: "live-side" });
    const now = el("section", { class: "section", "aria-label": "Now" });
    const counted = el("section", { class: "section", "aria-label": "Assemblies over time" });
    const events = el("section", { class: "section", "aria-label": "Events" });
    beside.append(now, counted, events);
    shell.main.replaceChildren(el("div", { class: "live" }, place, beside));
    shell.showState(null);
    this.video.disabled = true;
    const options = el(
      "div",
      { class: "options" },
      el("label", {}, this.video, " video"),
      el("label", {}, this.trails, " trails"),
    );
    place.append(options);
    this.tank = new TankCanvas(
      place,
      "The tank: blocks where the tracker sees them, dashed where it does not",
    );
    place.append(this.status, this.leftOut);
    now.append(el("h2", {}, "Now"), this.outcome, this.shapes.element, this.numbers);
    counted.append(el("h2", {}, "Assemblies over time"));
    this.counts = new ShapeCounts(counted);
    events.append(el("h2", {}, "Joins and partings"), this.list);
    this.take = newestWins((frame) => this.draw(frame));
    this.video.addEventListener("change", () => this.askForVideo());
    this.trails.addEventListener("change", () => this.last !== null && this.draw(this.last));
    onThemeChange(() => this.last !== null && this.draw(this.last));
    this.say("Waiting for the stream.");
  }

  opened(link: Link): void {
    this.link = link;
    this.askForVideo();
  }

  receive(message: Message): void {
    if (message.type === "hello") this.greet(message);
    else if (message.type === "frame") {
      const frame = checkFrame(message);
      this.note(frame);
      void this.schedule(frame);
    } else if (message.type === "note") this.leftOut.textContent = String(message["words"] ?? "");
    else if (message.type === "lost") {
      this.held.flush();
      this.say(String(message["words"] ?? "the tracker is gone"));
    } else if (message.type === "end") {
      this.held.flush();
      const why = message["interrupted"];
      this.say(typeof why === "string" ? `The stream has ended: ${why}` : "The stream has ended.");
    }
  }

  private greet(message: Message): void {
    this.leftOut.textContent = "";
    try {
      this.meet(checkHello(message, ""));
    } catch (error) {
      if (!(error instanceof PageError)) throw error;
      this.meet(UNKNOWN);
      this.say(`The tank is not drawn: ${error.message}.`);
    }
  }

  /** A stream begins: its tank, its camera. */
  private meet(hello: Hello): void {
    this.hello = hello;
    const { image } = hello;
    this.camera =
      image === null
        ? null
        : {
            width: image.width_px,
            height: image.height_px,
            homography: image.homography_px_to_m,
            lens: image.lens,
          };
    this.picture = null;
    this.held.drop();
    this.past.clear();
    this.counts.clear();
    this.list.replaceChildren();
    this.seenEvents.clear();
    this.video.disabled = this.camera === null;
    const box = hello.tank === null && this.camera !== null ? imageBox(this.camera) : boxAround(hello.tank);
    this.tank.setTank(hello.tank, [hello.block_side_m ?? 0, hello.block_width_m], box);
    this.say(hello.imageFault === null ? "" : `No video: ${hello.imageFault}.`);
    this.askForVideo();
  }

  private askForVideo(): void {
    const wanted = this.video.checked && this.camera !== null;
    this.link?.send({ type: "video", width: wanted ? VIDEO_WIDTH : 0 });
    if (!wanted) this.picture = null;
  }

  /** Keeps what must not be lost when the page draws more slowly than frames come. */
  private note(frame: Frame): void {
    for (const one of frame.events ?? []) this.addEvent(one);
    this.past.add(frame.time_s, frame.bodies);
  }

  /**
   * Lets a frame be drawn; blocks and the picture under them are of one frame, as long as pictures
   * come. A frame without one waits only for the next picture.
   */
  private async schedule(frame: Frame): Promise<void> {
    const { hello } = this;
    if (frame.jpeg_base64 !== null && this.video.checked) {
      const image = new Image();
      image.src = `data:image/jpeg;base64,${frame.jpeg_base64}`;
      await image.decode().catch(() => undefined);
      if (image.naturalWidth > 0 && this.video.checked && hello === this.hello) {
        this.picture = image;
        this.pictured = performance.now();
      }
    } else if (this.picture !== null) {
      const patience = this.pictured + PICTURE_MS - performance.now();
      if (patience > 0) {
        this.held.hold(frame, patience);
        this.link?.send({ type: "ready" });
        return;
      }
    }
    this.held.drop();
    this.take(frame);
  }

  private draw(frame: Frame): void {
    this.last = frame;
    const ids = frame.bodies.map((body) => body.id);
    const groups = assemblies(ids, frame.joined ?? []);
    const shapes = new Map<string, string>();
    for (const group of groups) {
      const name = shapeName(group, frame.joined ?? []);
      for (const id of group) shapes.set(id, name);
    }
    const picture = this.picture;
    const camera = this.camera;
    this.tank.draw({
      blocks: {
        x: frame.bodies.map((body) => body.x_m ?? Number.NaN),
        y: frame.bodies.map((body) => body.y_m ?? Number.NaN),
        theta: frame.bodies.map((body) => body.theta_rad ?? Number.NaN),
        colours: ids.map((id) => shapeColour(shapes.get(id) ?? "1")),
        hidden: frame.bodies.map((body) => !body.seen),
        names: ids,
      },
      trails: this.trails.checked ? this.trailsNow(shapes) : [],
      under: picture === null || camera === null ? null : (view: View) => drawVideo(view, picture, camera),
    });
    this.link?.send({ type: "ready" });
    this.tank.element.dataset["time"] = String(frame.time_s);
    if (frame.joined !== null) {
      const counts = countOf(groups.map((group) => shapes.get(group[0] ?? "") ?? "1"));
      this.counts.add(frame.time_s, counts);
      this.shapes.show(counts);
    }
    this.showNow(frame);
  }

  private trailsNow(shapes: ReadonlyMap<string, string>): Trail[] {
    return this.past.all().map(({ id, x, y }) => ({ x, y, colour: shapeColour(shapes.get(id) ?? "1") }));
  }

  private showNow(frame: Frame): void {
    const words = outcomeText(frame);
    if (this.outcome.textContent !== words) this.outcome.textContent = words;
    const seen = frame.bodies.filter((body) => body.seen).length;
    this.numbers.replaceChildren(
      facts([
        ["time", duration(frame.time_s)],
        ["frame", whole(frame.frame)],
        ["blocks seen", `${seen} of ${frame.bodies.length}`],
        ["latency", frame.latency_s === null ? "–" : quantity(frame.latency_s, "s", 2)],
        ["frames dropped", frame.dropped_frames === null ? "–" : whole(frame.dropped_frames)],
        ["source", this.hello?.source ?? "–"],
      ]),
    );
    Object.assign(document.documentElement.dataset, {
      outcome: frame.outcome ?? "",
      frame: String(frame.frame),
    });
  }

  private addEvent(one: LiveEvent): void {
    const key = `${one.time_s} ${one.kind} ${one.bodies.join(" ")}`;
    if (this.seenEvents.has(key)) return;
    this.seenEvents.add(key);
    const verb = one.kind === "join" ? "joined" : "parted";
    const item = el(
      "li",
      {},
      el("span", { class: "name" }, `${fixed(one.time_s, 1)} s`),
      ` ${one.bodies.join(" and ")} ${verb}`,
      one.outcome !== null && el("b", {}, `, now ${outcomeWords(one.outcome)}`),
    );
    this.list.prepend(item);
    while (this.list.childElementCount > MOST_EVENTS) this.list.lastElementChild?.remove();
  }

  private say(words: string): void {
    this.status.textContent = words;
  }
}

/** Returns an outcome class as it can be read: of a long one only in how many parts it is. */
function outcomeWords(outcome: string): string {
  const parts = outcome.split("+").length;
  return outcome.length <= LONGEST_OUTCOME && !outcome.includes("x")
    ? outcome
    : `${parts} ${parts === 1 ? "assembly" : "assemblies"}`;
}

function countOf(shapes: readonly string[]): Map<string, number> {
  const counts = new Map<string, number>();
  for (const shape of shapes) counts.set(shape, (counts.get(shape) ?? 0) + 1);
  return counts;
}

function outcomeText(frame: Frame): string {
  if (frame.outcome !== null) return outcomeWords(frame.outcome);
  if (frame.joined === null) return "The stream does not report joins.";
  if (frame.possible === null || frame.possible.length === 0) return "not known: a block is hidden";
  return `${frame.possible.map(outcomeWords).join(" or ")}: a block is hidden`;
}
