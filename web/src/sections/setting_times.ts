/** The outcome classes of one setting over time, beside those of the reference. */

import { at, decode, decodeMaybe, nearest, part } from "../arrays";
import { type Course, drawCourses } from "../charts/courses";
import { onPointer } from "../charts/hover";
import { figure } from "../charts/responsive";
import { classLegend } from "../class_legend";
import { type Context, classColours, remembered } from "../context";
import { el } from "../dom";
import type { Cell } from "../keyboard";
import type { L1MapSection, OverTime } from "../page";
import { details, readout, table } from "../parts";
import { inUnit, percent } from "../units";

/** What is kept of one setting. */
export interface SettingTimes {
  readonly time: Float64Array;
  readonly setting: readonly Course[];
  /** Null where the reference keeps none. */
  readonly reference: readonly Course[] | null;
}

type Source = (cell: Cell) => Promise<SettingTimes | null>;

/** Returns how the classes of a setting are found: in the page, at the server, or not at all. */
export function timesSource(section: L1MapSection, context: Context): Source {
  const { over_time: kept } = section;
  const { fetchCell } = context;
  if (kept !== null) {
    const all = decodeTimes(kept, context);
    return async ({ row, column }) => (await all)(row, column);
  }
  if (fetchCell === null) return async () => null;
  return async ({ row, column }) => {
    const { overTime } = await fetchCell(section.id, row, column);
    return overTime === null ? null : (await decodeTimes(overTime, context))(0, 0);
  };
}

/** Returns what gives the classes of the setting at a row and a column. */
export async function decodeTimes(
  kept: OverTime,
  context: Context,
): Promise<(row: number, column: number) => SettingTimes> {
  const [time, count, runs, reference] = await Promise.all([
    decode(kept.time),
    decode(kept.count),
    decode(kept.runs),
    decodeMaybe(kept.reference),
  ]);
  const colours = classColours(context);
  const courses = (shares: (index: number) => Float64Array): Course[] =>
    kept.classes.map((name, index) => ({
      name,
      cells: kept.cells[index] ?? [],
      colour: colours.of(name),
      share: shares(index),
      low: null,
      high: null,
    }));
  return (row, column) => {
    const all = at(part(runs, row), column);
    return {
      time: time.data,
      setting: courses((index) => part(count, row, column, index).map((number) => number / all)),
      reference: reference === null ? null : courses((index) => part(reference, index)),
    };
  };
}

/** Draws into `body`, which has to be in the document; an open table stays open for the next setting. */
export function drawSettingTimes(
  body: HTMLElement,
  { time, setting, reference }: SettingTimes,
  context: Context,
): void {
  if (!setting.some((one) => one.share.some(Number.isFinite))) {
    body.append(el("p", { class: "nothing" }, "No run of this setting has an outcome."));
    return;
  }
  const line = readout(
    reference === null
      ? "Point at the chart to read shares."
      : "Point at a chart to read shares: this setting, reference.",
  );
  const pair = el("div", { class: "pair-grid times" });
  body.append(pair);
  const draw = (title: string, courses: readonly Course[]): void => {
    const column = el("div", {}, el("h4", {}, title));
    pair.append(column);
    figure(column, "", (width) => {
      const frame = drawCourses(width, `Outcome classes over time, ${title.toLowerCase()}`, time, courses, "stacked");
      onPointer(frame, (place) =>
        line.show(place === null ? null : reading(time, setting, reference, place.x)),
      );
      return frame.svg;
    });
  };
  draw("This setting", setting);
  if (reference !== null) draw("Reference", reference);
  else pair.append(el("p", { class: "nothing" }, "The reference kept no classes at these times."));
  const occurring = setting.filter(
    (one, index) => occurs(one) || (reference !== null && occurs(reference[index])),
  );
  const shown = remembered(context, "table of shares over time", () => ({ open: false }));
  const more = details("Shares over time as a table", () => timesTable(time, setting, reference));
  more.open = shown.open;
  more.addEventListener("toggle", () => {
    shown.open = more.open;
  });
  body.append(classLegend(occurring), line.element, more);
}

function occurs(course: Course | undefined): boolean {
  return course !== undefined && course.share.some((share) => share > 0);
}

function reading(
  time: Float64Array,
  setting: readonly Course[],
  reference: readonly Course[] | null,
  place: number,
): [string, string][] {
  const index = nearest(time, place);
  const pairs: [string, string][] = [["time", moment(at(time, index))]];
  setting.forEach((one, number) => {
    const beside = reference?.[number];
    const both = [one, ...(beside === undefined ? [] : [beside])];
    const shares = both.map((course) => at(course.share, index));
    if (shares.some((share) => share > 0)) pairs.push([one.name, shares.map((share) => percent(share)).join(", ")]);
  });
  return pairs;
}

function moment(time: number): string {
  return inUnit(time, { factor: 1, unit: "s" });
}

function timesTable(
  time: Float64Array,
  setting: readonly Course[],
  reference: readonly Course[] | null,
): HTMLElement {
  const heads = setting.flatMap((one) =>
    reference === null ? [one.name] : [one.name, `${one.name}, reference`],
  );
  const rows = Array.from(time, (now, index) => [
    moment(now),
    ...setting.flatMap((one, number) => {
      const beside = reference?.[number];
      const both = [one, ...(beside === undefined ? [] : [beside])];
      return both.map((course) => percent(at(course.share, index)));
    }),
  ]);
  return table("Shares of the outcome classes over time", ["time", ...heads], rows, () => true);
}
