/** Shares of the outcome classes over time: areas on top of each other, or lines. */

import { type Grid, at, decode, decodeMaybe, extent, nearest } from "../arrays";
import { type Frame, makeFrame } from "../charts/frame";
import { onPointer } from "../charts/hover";
import { bandPath, linePath } from "../charts/paths";
import { figure } from "../charts/responsive";
import { classLegend } from "../class_legend";
import { type Context, classColours, remembered } from "../context";
import { el, svg } from "../dom";
import type { ClassTimesSection, Polyominoes } from "../page";
import { choices, readout } from "../parts";
import { displayFor, inUnit, percent } from "../units";

interface Course {
  readonly name: string;
  readonly cells: Polyominoes;
  readonly colour: string;
  readonly share: Float64Array;
  readonly low: Grid | null;
  readonly high: Grid | null;
}

type Form = "stacked" | "lines";

export async function drawClassTimes(
  section: ClassTimesSection,
  body: HTMLElement,
  context: Context,
): Promise<void> {
  const time = (await decode(section.time)).data;
  const courses = await decodeCourses(section, context);
  const form = remembered(context, `class times ${section.id}`, (): { now: Form } => ({ now: "stacked" }));
  const holder = el("div", { class: "wide" });
  body.append(holder);
  const forms = [
    ["stacked", "areas"],
    ["lines", "lines with intervals"],
  ] as const;
  holder.append(
    choices("Form of the chart", forms, form.now, (now) => {
      form.now = now;
      chart.redraw();
    }),
  );
  const line = readout("Point at the chart to read shares.");
  const chart = figure(holder, "", (width) => {
    const frame = drawCourses(width, section.title, time, courses, form.now);
    onPointer(frame, (place) => line.show(place === null ? null : reading(time, courses, place.x)));
    return frame.svg;
  });
  holder.append(classLegend(courses), line.element);
}

async function decodeCourses(section: ClassTimesSection, context: Context): Promise<Course[]> {
  const colours = classColours(context);
  return Promise.all(
    section.classes.map(async (one) => ({
      name: one.class,
      cells: one.cells,
      colour: colours.of(one.class),
      share: (await decode(one.share)).data,
      low: await decodeMaybe(one.low),
      high: await decodeMaybe(one.high),
    })),
  );
}

function drawCourses(
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

function reading(time: Float64Array, courses: readonly Course[], place: number): [string, string][] {
  const index = nearest(time, place);
  const shares = courses
    .filter((one) => at(one.share, index) > 0)
    .map((one): [string, string] => [one.name, percent(at(one.share, index))]);
  return [["time", inUnit(at(time, index), { factor: 1, unit: "s" })], ...shares];
}
