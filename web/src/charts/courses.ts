/** Shares of classes over time: areas on top of each other, or lines with their intervals. */

import { type Grid, at, extent } from "../arrays";
import { svg } from "../dom";
import type { Square } from "../polyomino";
import { displayFor, percent } from "../units";
import { type Frame, makeFrame } from "./frame";
import { bandPath, linePath } from "./paths";

export interface Course {
  readonly name: string;
  readonly cells: readonly Square[];
  readonly colour: string;
  readonly share: Float64Array;
  readonly low: Grid | null;
  readonly high: Grid | null;
}

export type Form = "stacked" | "lines";

export function drawCourses(
  width: number,
  title: string,
  time: Float64Array,
  courses: readonly Course[],
  form: Form,
): Frame {
  const span = extent(time) ?? [0, 1];
  const top =
    form === "stacked"
      ? 1
      : Math.max(
          0.05,
          ...courses.flatMap((one) => [...one.share, ...(one.high?.data ?? [])].filter(Number.isFinite)),
        );
  const ends = courses.map((one) => `${one.name} ends at ${percent(at(one.share, one.share.length - 1))}`);
  const frame = makeFrame({
    width,
    height: Math.min(300, Math.max(190, width * 0.4)),
    x: { domain: span, label: "time", display: displayFor("s", span) },
    y: { domain: [0, Math.min(1, top)], label: "share of runs", display: { factor: 100, unit: "%" } },
    grid: form === "lines" ? "y" : "none",
    label: `${title}: ${ends.join(", ")}`,
  });
  const px = time.map(frame.x.px);
  if (form === "stacked") drawStack(frame, px, courses);
  else for (const one of courses) drawCourse(frame, px, one);
  return frame;
}

function drawStack(frame: Frame, px: Float64Array, courses: readonly Course[]): void {
  const below = new Float64Array(px.length);
  for (const one of courses) {
    const low = below.map(frame.y.px);
    one.share.forEach((share, index) => {
      below[index] = at(below, index) + (Number.isFinite(share) ? share : 0);
    });
    const area = svg("path", { class: "area", d: bandPath(px, low, below.map(frame.y.px)) });
    area.style.setProperty("fill", one.colour);
    frame.plot.append(area);
  }
}

function drawCourse(frame: Frame, px: Float64Array, one: Course): void {
  const group = svg("g");
  group.style.setProperty("color", one.colour);
  if (one.low !== null && one.high !== null) {
    const band = bandPath(px, one.low.data.map(frame.y.px), one.high.data.map(frame.y.px));
    group.append(svg("path", { class: "band", d: band }));
  }
  group.append(svg("path", { class: "series", d: linePath(px, one.share.map(frame.y.px)) }));
  frame.plot.append(group);
}
