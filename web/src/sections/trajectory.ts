/** The recording: its path in the tank, position over time with gaps, speeds. */

import { type Grid, at, decode, extent } from "../arrays";
import { drawColourBar, BAR_ROOM } from "../charts/colour_bar";
import { makeFrame } from "../charts/frame";
import { linePath, thinnedSeries } from "../charts/paths";
import { figure } from "../charts/responsive";
import { drawOutline, makeTankFrame } from "../charts/tank_frame";
import { colourScale, css } from "../colours";
import { el, svg } from "../dom";
import type { TrajectorySection } from "../page";
import { facts, legend } from "../parts";
import { niceDomain } from "../scale";
import { boxAround } from "../tank/outline";
import { displayFor, quantity, short, whole } from "../units";

/** Pieces of the path that have a colour of their own. */
const PIECES = 96;

export async function drawTrajectory(section: TrajectorySection, body: HTMLElement): Promise<void> {
  const [time, x, y] = await Promise.all([decode(section.time), decode(section.x), decode(section.y)]);
  const columns = el("div", { class: "columns" });
  const beside = el("div", { class: "stack" });
  const path = el("div", { class: "stack" });
  columns.append(path, beside);
  body.append(columns);
  figure(path, "square", (width) => drawPath(width, section, time, x, y));
  figure(beside, "", (width) => drawPosition(width, section, time, x, "x"));
  figure(beside, "", (width) => drawPosition(width, section, time, y, "y"));
  if (section.gaps.length > 0) {
    beside.append(legend([{ swatch: "band", colour: "var(--muted)", text: "gap: no position" }]));
  }
  const { speed } = section;
  if (speed !== null) figure(beside, "", (width) => drawSpeeds(width, speed));
  body.append(facts(section.facts.map((fact) => [fact.label, factText(fact), fact.note])));
}

function factText(fact: TrajectorySection["facts"][number]): string {
  if (typeof fact.value !== "number") return String(fact.value ?? "–");
  // A count is written out, a measure to what can be read.
  const isCount = Number.isInteger(fact.value) && (fact.unit === null || fact.unit === "1");
  const value = isCount ? whole(fact.value) : quantity(fact.value, fact.unit);
  if (fact.low === null || fact.high === null) return value;
  return `${value} (${quantity(fact.low, fact.unit)} to ${quantity(fact.high, fact.unit)})`;
}

function drawPath(width: number, section: TrajectorySection, time: Grid, x: Grid, y: Grid): Element {
  const box = boxAround(section.arena, x.data, y.data);
  const span = extent(time.data) ?? [0, 1];
  const frame = makeTankFrame(width, box, {
    label: `Path of the block in the tank over ${short(span[1] - span[0])} s, coloured by time`,
    right: BAR_ROOM,
  });
  const scale = colourScale("score", span[0], span[1]);
  const [px, py] = [x.data.map(frame.x.px), y.data.map(frame.y.px)];
  const size = Math.max(1, Math.ceil(px.length / PIECES));
  for (let start = 0; start < px.length; start += size) {
    const end = Math.min(start + size + 1, px.length);
    const colour = scale.of(at(time.data, start));
    if (colour === null) continue;
    frame.plot.append(svg("path", { class: "trail", d: linePath(px, py, start, end), stroke: css(colour) }));
  }
  drawOutline(frame, section.arena);
  drawColourBar(frame, { scale, label: "time (s)", display: { factor: 1, unit: "s" } });
  return frame.svg;
}

function drawPosition(
  width: number,
  section: TrajectorySection,
  time: Grid,
  values: Grid,
  name: "x" | "y",
): Element {
  const reach = extent(values.data) ?? [0, 1];
  const span = extent(time.data) ?? [0, 1];
  const frame = makeFrame({
    width,
    height: 84,
    x: { domain: span, label: name === "x" ? "" : "time", display: displayFor("s", span) },
    y: { domain: niceDomain(...reach, 4), label: name, display: displayFor("m", reach) },
    label: `${name} over time, ${section.gaps.length} gaps`,
  });
  for (const [from, to] of section.gaps) {
    const left = frame.x.px(from);
    frame.plot.append(
      svg("rect", {
        class: "gap",
        x: left,
        y: frame.top,
        width: Math.max(1, frame.x.px(to) - left),
        height: frame.height,
      }),
    );
  }
  const line = thinnedSeries(time.data, values.data, frame.width);
  const path = linePath(line.x.map(frame.x.px), line.y.map(frame.y.px));
  frame.plot.append(svg("path", { class: "series thin blue", d: path }));
  return frame.svg;
}

function drawSpeeds(width: number, speed: { edges: number[]; density: (number | null)[] }): Element {
  const display = displayFor("m/s", speed.edges);
  const top = extent(speed.density.map((value) => value ?? Number.NaN))?.[1] ?? 1;
  const frame = makeFrame({
    width,
    height: 110,
    x: { domain: [speed.edges[0] ?? 0, speed.edges.at(-1) ?? 1], label: "speed", display },
    // A density over a unit that is shown larger is smaller by the same factor.
    y: {
      domain: [0, top * 1.06],
      label: "density",
      display: { factor: 1 / display.factor, unit: `per ${display.unit}` },
    },
    label: "Histogram of the speeds",
  });
  speed.density.forEach((value, index) => {
    const [left, right] = [frame.x.px(speed.edges[index] ?? 0), frame.x.px(speed.edges[index + 1] ?? 0)];
    const high = frame.y.px(value ?? 0);
    frame.plot.append(
      svg("rect", {
        class: "bar",
        x: left,
        y: high,
        width: Math.max(0, right - left - 0.5),
        height: frame.top + frame.height - high,
      }),
    );
  });
  return frame.svg;
}
