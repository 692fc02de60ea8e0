/** Shares of the outcome classes over time: areas on top of each other, or lines. */

import { at, decode, decodeMaybe, nearest } from "../arrays";
import { type Course, type Form, drawCourses } from "../charts/courses";
import { onPointer } from "../charts/hover";
import { figure } from "../charts/responsive";
import { classLegend } from "../class_legend";
import { type Context, classColours, remembered } from "../context";
import { el } from "../dom";
import type { ClassTimesSection } from "../page";
import { choices, readout } from "../parts";
import { inUnit, percent } from "../units";

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

function reading(time: Float64Array, courses: readonly Course[], place: number): [string, string][] {
  const index = nearest(time, place);
  const shares = courses
    .filter((one) => at(one.share, index) > 0)
    .map((one): [string, string] => [one.name, percent(at(one.share, index))]);
  return [["time", inUnit(at(time, index), { factor: 1, unit: "s" })], ...shares];
}
