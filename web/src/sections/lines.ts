/** A chart of lines, points and steps, with bands and marks. */

import { type Grid, at, decode, decodeMaybe, extent, nearest } from "../arrays";
import { type Frame, makeFrame } from "../charts/frame";
import { type Place, onPointer } from "../charts/hover";
import { bandPath, linePath } from "../charts/paths";
import { figure } from "../charts/responsive";
import { seriesColour } from "../colours";
import { el, svg } from "../dom";
import type { LinesSection } from "../page";
import { details, legend, readout, table } from "../parts";
import { niceDomain } from "../scale";
import { shortName, spoken } from "../symbols";
import { type Display, displayFor, inUnit, labelled, short } from "../units";

interface Series {
  readonly name: string;
  readonly style: "line" | "points" | "step";
  readonly x: Float64Array;
  readonly y: Float64Array;
  readonly low: Float64Array | null;
  readonly high: Float64Array | null;
  readonly colour: string;
}

interface Chart {
  readonly section: LinesSection;
  readonly series: readonly Series[];
  readonly xDomain: [number, number];
  readonly yDomain: [number, number];
  readonly xDisplay: Display;
  readonly yDisplay: Display;
}

export async function drawLines(section: LinesSection, body: HTMLElement): Promise<void> {
  const chart = makeChart(section, await Promise.all(section.series.map(decodeSeries)));
  if (chart === null) {
    body.append(el("p", { class: "nothing" }, "There are no values yet."));
    return;
  }
  const line = readout("Point at the chart to read values.");
  const holder = el("div", { class: "wide" });
  body.append(holder);
  figure(holder, "", (width) => {
    const frame = drawChart(width, chart);
    onPointer(frame, (place) => line.show(place === null ? null : reading(chart, place)));
    return frame.svg;
  });
  const marks = section.marks.filter((mark) => mark.label !== "");
  if (chart.series.length > 1 || marks.length > 0) {
    holder.append(
      legend([
        ...chart.series.map((one) => ({
          swatch: one.style === "points" ? ("dot" as const) : ("line" as const),
          colour: one.colour,
          text: one.name,
        })),
        ...marks.map((mark) => ({
          swatch: mark.x !== null && mark.y !== null ? ("ring" as const) : ("dash" as const),
          colour: "var(--muted)",
          text: mark.label,
        })),
      ]),
    );
  }
  holder.append(
    line.element,
    details("Values as a table", () => valueTable(chart)),
  );
}

async function decodeSeries(source: LinesSection["series"][number], index: number): Promise<Series> {
  const [x, y, low, high] = await Promise.all([
    decode(source.x),
    decode(source.y),
    decodeMaybe(source.low),
    decodeMaybe(source.high),
  ]);
  const data = (grid: Grid | null): Float64Array | null => grid?.data ?? null;
  const colour = index === 0 ? "var(--blue)" : index === 1 ? "var(--orange)" : seriesColour(index);
  return {
    name: source.name,
    style: source.style,
    x: x.data,
    y: y.data,
    low: data(low),
    high: data(high),
    colour,
  };
}

function makeChart(section: LinesSection, series: Series[]): Chart | null {
  const xs = [...series.flatMap((one) => [...one.x]), ...section.marks.map((mark) => mark.x ?? Number.NaN)];
  const ys = [
    ...series.flatMap((one) => [...one.y, ...(one.low ?? []), ...(one.high ?? [])]),
    ...section.marks.map((mark) => mark.y ?? Number.NaN),
  ];
  const positive = (values: number[], log: boolean | null): number[] =>
    log === true ? values.filter((v) => v > 0) : values;
  const across = extent(positive(xs, section.x.log));
  const up = extent(positive(ys, section.y.log));
  if (across === null || up === null) return null;
  const points = series.some((one) => one.style === "points");
  return {
    section,
    series,
    xDomain: section.x.log === true ? widened(across, true) : points ? widened(across, false) : across,
    yDomain: section.y.log === true ? widened(up, true) : withZero(up),
    xDisplay: displayFor(section.x.unit, across),
    yDisplay: displayFor(section.y.unit, up),
  };
}

/** Returns a range with some room at both ends, so that no point lies on the frame. */
function widened([low, high]: [number, number], log: boolean): [number, number] {
  if (log) {
    const room = (high / low) ** 0.05 || 1.1;
    return high > low ? [low / room, high * room] : [low / 2, high * 2];
  }
  const room = high > low ? 0.04 * (high - low) : Math.abs(low) / 2 || 1;
  return [low - room, high + room];
}

/** Returns a round range; zero belongs to it when the values come near. */
function withZero([low, high]: [number, number]): [number, number] {
  const near = low > 0 && low < 0.35 * high;
  const [from, to] = niceDomain(near ? 0 : low, high);
  return [from, to];
}

function drawChart(width: number, chart: Chart): Frame {
  const { section } = chart;
  const names = chart.series.map((one) => one.name);
  const frame = makeFrame({
    width,
    height: Math.min(320, Math.max(190, width * 0.42)),
    x: {
      domain: chart.xDomain,
      label: section.x.label,
      display: chart.xDisplay,
      log: section.x.log === true,
    },
    y: {
      domain: chart.yDomain,
      label: section.y.label,
      display: chart.yDisplay,
      log: section.y.log === true,
    },
    grid: "y",
    label: `${section.title}: ${spoken(section.y.label)} over ${spoken(section.x.label)}; ${names.join(", ")}`,
  });
  for (const one of chart.series) drawSeries(frame, one);
  for (const mark of section.marks) drawMark(frame, mark);
  return frame;
}

function drawSeries(frame: Frame, one: Series): void {
  const group = svg("g");
  group.style.setProperty("color", one.colour);
  const [px, py] = [one.x.map(frame.x.px), one.y.map(frame.y.px)];
  const [low, high] = [one.low?.map(frame.y.px) ?? null, one.high?.map(frame.y.px) ?? null];
  if (one.style === "points") drawPoints(group, px, py, low, high);
  else if (one.style === "step") {
    const [x, y] = stairs(px, py);
    if (low !== null && high !== null) {
      group.append(svg("path", { class: "band", d: bandPath(x, stairs(px, low)[1], stairs(px, high)[1]) }));
    }
    group.append(svg("path", { class: "series", d: linePath(x, y) }));
  } else {
    if (low !== null && high !== null)
      group.append(svg("path", { class: "band", d: bandPath(px, low, high) }));
    group.append(svg("path", { class: "series", d: linePath(px, py) }));
  }
  frame.plot.append(group);
}

/** Returns the corners of steps: between edges when there is one more x than y, else from each x on. */
function stairs(x: Float64Array, y: Float64Array): [number[], number[]] {
  const [stepX, stepY]: [number[], number[]] = [[], []];
  for (let index = 0; index < y.length; index += 1) {
    stepX.push(at(x, index), at(x, Math.min(index + 1, x.length - 1)));
    stepY.push(at(y, index), at(y, index));
  }
  return [stepX, stepY];
}

function drawPoints(
  group: SVGGElement,
  x: Float64Array,
  y: Float64Array,
  low: Float64Array | null,
  high: Float64Array | null,
): void {
  let whiskers = "";
  x.forEach((px, index) => {
    const [bottom, top] = [
      low === null ? Number.NaN : at(low, index),
      high === null ? Number.NaN : at(high, index),
    ];
    if (Number.isFinite(bottom + top)) whiskers += `M${px.toFixed(1)} ${bottom.toFixed(1)}V${top.toFixed(1)}`;
  });
  if (whiskers !== "") group.append(svg("path", { class: "series thin", d: whiskers }));
  const radius = x.length > 400 ? 1.8 : 3;
  x.forEach((px, index) => {
    const py = at(y, index);
    if (Number.isFinite(px + py)) group.append(svg("circle", { class: "point", cx: px, cy: py, r: radius }));
  });
}

function drawMark(frame: Frame, mark: LinesSection["marks"][number]): void {
  const [right, bottom] = [frame.left + frame.width, frame.top + frame.height];
  const x = mark.x === null ? null : frame.x.px(mark.x);
  const y = mark.y === null ? null : frame.y.px(mark.y);
  if (x !== null && y !== null) frame.front.append(svg("circle", { class: "mark", cx: x, cy: y, r: 5 }));
  else if (x !== null)
    frame.plot.append(svg("line", { class: "mark", x1: x, x2: x, y1: frame.top, y2: bottom }));
  else if (y !== null)
    frame.plot.append(svg("line", { class: "mark", x1: frame.left, x2: right, y1: y, y2: y }));
}

function reading(chart: Chart, place: Place): [string, string][] {
  const pairs: [string, string][] = [[shortName(chart.section.x.label), inUnit(place.x, chart.xDisplay)]];
  for (const one of chart.series) {
    const index = one.style === "step" ? stepAt(one.x, place.x) : nearest(one.x, place.x);
    const value = at(one.y, index);
    if (!Number.isFinite(value)) continue;
    const [low, high] = [at(one.low ?? [], index), at(one.high ?? [], index)];
    const spread = Number.isFinite(low + high)
      ? ` (${short(low * chart.yDisplay.factor)} to ${short(high * chart.yDisplay.factor)})`
      : "";
    pairs.push([one.name, `${inUnit(value, chart.yDisplay)}${spread}`]);
  }
  return pairs;
}

function stepAt(x: Float64Array, value: number): number {
  let index = -1;
  while (index + 1 < x.length && at(x, index + 1) <= value) index += 1;
  return index;
}

function valueTable(chart: Chart): HTMLElement {
  const { section } = chart;
  const columns = [
    "series",
    labelled(spoken(section.x.label), chart.xDisplay),
    labelled(spoken(section.y.label), chart.yDisplay),
    "from",
    "to",
  ];
  const rows = chart.series.flatMap((one) =>
    Array.from(one.y, (value, index) => [
      one.name,
      short(at(one.x, index) * chart.xDisplay.factor, 4),
      short(value * chart.yDisplay.factor, 4),
      short(at(one.low ?? [], index) * chart.yDisplay.factor, 4),
      short(at(one.high ?? [], index) * chart.yDisplay.factor, 4),
    ]),
  );
  return table(section.title, columns, rows, (column) => column > 0);
}
