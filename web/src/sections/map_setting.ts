/** One setting of the map beside the recording: excerpts in the tank, densities of the steps. */

import { type Grid, at, decode, decodeMaybe } from "../arrays";
import { type DensityLook, densityLook, drawDensity } from "../charts/density";
import { linePath } from "../charts/paths";
import { figure } from "../charts/responsive";
import { drawOutline, makeTankFrame } from "../charts/tank_frame";
import { el, svg } from "../dom";
import type { Arena } from "../page";
import { type Swatch, legend } from "../parts";
import { boxAround } from "../tank/outline";
import { quantity } from "../units";
import type { Excerpt, MapData } from "./map_data";

export interface Recorded {
  readonly density: Grid;
  readonly x: Grid | null;
  readonly y: Grid | null;
}

export async function decodeRecorded(map: MapData): Promise<Recorded | null> {
  const { recording } = map.section;
  if (recording === null) return null;
  const [density, x, y] = await Promise.all([
    decode(recording.density),
    decodeMaybe(recording.excerpt_x),
    decodeMaybe(recording.excerpt_y),
  ]);
  return { density, x, y };
}

/** Draws into `body`, which has to be in the document. */
export function drawSetting(
  body: HTMLElement,
  map: MapData,
  recorded: Recorded | null,
  excerpt: Excerpt,
  whose: string,
): void {
  const pair = el("div", { class: "pair-grid" });
  body.append(pair);
  const { arena } = map.section;
  const span = excerptSpan(excerpt);
  if (recorded !== null && recorded.x !== null && recorded.y !== null) {
    drawExcerpt(
      column(pair, "Recording"),
      arena,
      recorded.x.data,
      recorded.y.data,
      `Path of the recording${span}`,
    );
  }
  const head = `${whose.charAt(0).toUpperCase()}${whose.slice(1)}`;
  drawExcerpt(column(pair, head), arena, excerpt.x, excerpt.y, `Path of ${whose}${span}`);
  const edges = map.section.recording;
  if (recorded === null || edges === null || excerpt.density === null) return;
  const bins = { length: edges.step_length_edges, angle: edges.turning_angle_edges };
  const look = densityLook(bins, [recorded.density, excerpt.density]);
  const cross = { length: excerpt.ksStepLength, angle: excerpt.ksTurningAngle };
  const densities = el("div", { class: "pair-grid" });
  body.append(densities);
  drawShare(densities, recorded.density, look, "Steps of the recording", cross);
  drawShare(densities, excerpt.density, look, `Steps of ${whose}`, cross);
  const drawn: { swatch: Swatch; colour: string; text: string }[] = [
    { swatch: "dot", colour: "var(--green)", text: `start of the path${span}` },
    { swatch: "dot", colour: "var(--orange)", text: "end" },
  ];
  if (Number.isFinite(cross.length + cross.angle)) {
    const place = `${quantity(cross.length, "m")}, ${quantity(cross.angle, "rad")}`;
    drawn.push({
      swatch: "cross",
      colour: "var(--blue)",
      text: `the distributions differ most here (${place})`,
    });
  }
  body.append(legend(drawn));
}

function excerptSpan(excerpt: Excerpt): string {
  const time = excerpt.time;
  if (time === null || time.data.length < 2) return "";
  return `, ${quantity(at(time.data, time.data.length - 1) - at(time.data, 0), "s")}`;
}

function column(parent: HTMLElement, title: string): HTMLElement {
  const element = el("div", {}, el("h4", {}, title));
  parent.append(element);
  return element;
}

function drawExcerpt(
  parent: HTMLElement,
  arena: Arena | null,
  x: ArrayLike<number>,
  y: ArrayLike<number>,
  label: string,
): void {
  const known = Array.from(x, (_, index) => index).filter((index) =>
    Number.isFinite(at(x, index) + at(y, index)),
  );
  const [first, last] = [known[0], known.at(-1)];
  if (first === undefined || last === undefined) {
    parent.append(el("p", { class: "nothing" }, "No path was kept."));
    return;
  }
  const box = boxAround(arena, Array.from(x), Array.from(y), 0.02);
  figure(parent, "excerpt", (width) => {
    const frame = makeTankFrame(width, box, { label, axes: false, right: 2 });
    const px = Array.from(x, frame.x.px);
    const py = Array.from(y, frame.y.px);
    frame.plot.append(svg("path", { class: "trail ink", d: linePath(px, py) }));
    drawOutline(frame, arena);
    frame.plot.append(
      svg("circle", { class: "start", cx: at(px, first), cy: at(py, first), r: 3.5 }),
      svg("circle", { class: "end", cx: at(px, last), cy: at(py, last), r: 3.5 }),
    );
    return frame.svg;
  });
}

function drawShare(
  parent: HTMLElement,
  share: Grid,
  look: DensityLook,
  label: string,
  cross: { length: number; angle: number },
): void {
  const holder = el("div");
  parent.append(holder);
  figure(holder, "density", (width) => drawDensity({ width, share, look, label, cross }));
}
