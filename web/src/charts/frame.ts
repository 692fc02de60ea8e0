/** Axes around a plot: frame, ticks, labels with units. Values are SI, ticks in display units. */

import { freshId, svg } from "../dom";
import { type Scale, linearScale, linearTicks, logScale, logTicks } from "../scale";
import { richSvg } from "../symbols";
import { type Display, fixed, labelled, short, stepDecimals } from "../units";

export interface AxisOptions {
  readonly domain: readonly [number, number];
  readonly label: string;
  readonly display: Display;
  readonly log?: boolean;
  /** Ticks at places of one's own, in SI, with their text. */
  readonly ticks?: readonly Tick[];
}

export interface FrameOptions {
  readonly width: number;
  /** Height of the plot without labels [px]; equal scales of both axes when left out. */
  readonly height?: number;
  readonly x: AxisOptions;
  readonly y: AxisOptions;
  /** Room at the right, for a colour bar [px]. */
  readonly right?: number;
  readonly top?: number;
  /** What the picture shows, for those who do not see it. */
  readonly label: string;
  readonly grid?: "y" | "none";
}

export interface Frame {
  readonly svg: SVGSVGElement;
  readonly defs: SVGDefsElement;
  /** Where data are drawn; clipped to the frame. */
  readonly plot: SVGGElement;
  /** Where marks are drawn that may reach over the frame. */
  readonly front: SVGGElement;
  readonly x: Scale;
  readonly y: Scale;
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

export interface Tick {
  readonly at: number;
  readonly text: string;
}

const TICK = 4;
/** Width of a letter of a tick [px]. */
export const LETTER = 6.6;
/** Height of a line of a label [px]. */
export const LINE = 15;

export function makeFrame(options: FrameOptions): Frame {
  const top = options.top ?? 8;
  const right = options.right ?? 10;
  // The width of the labels of y depends on its ticks, their number on the height: guess once.
  const guess = options.height ?? options.width;
  const yTicks = ticksOf(options.y, guess / 46);
  const widest = Math.max(1, ...yTicks.map((tick) => tick.text.length));
  const yLabel = labelLines(options.y, guess);
  const written = yTicks.length === 0 ? 2 : Math.ceil(widest * LETTER) + TICK + 6;
  const left = written + (yLabel.length === 0 ? 0 : LINE * yLabel.length + 5);
  const width = Math.max(40, options.width - left - right);
  const height = options.height ?? (width * spanOf(options.y)) / spanOf(options.x);
  // The label is centred on its axis: it may reach as far to both sides as there is room on the narrower.
  const xLabel = labelLines(options.x, width + 2 * Math.min(left, right));
  const ticked = options.x.ticks === undefined || options.x.ticks.length > 0;
  const bottom = (ticked ? TICK + LINE : 0) + (xLabel.length === 0 ? 2 : LINE * xLabel.length + 6);

  const total = top + height + bottom;
  const picture = svg("svg", {
    class: "plot",
    viewBox: `0 0 ${options.width} ${total}`,
    width: options.width,
    height: total,
    role: "img",
    "aria-label": options.label,
  });
  const clip = freshId("clip");
  const defs = svg(
    "defs",
    {},
    svg("clipPath", { id: clip }, svg("rect", { x: left, y: top, width, height })),
  );
  const plot = svg("g", { "clip-path": `url(#${clip})` });
  const front = svg("g");
  const x = scaleOf(options.x, left, left + width);
  const y = scaleOf(options.y, top + height, top);
  const frame = { svg: picture, defs, plot, front, x, y, left, top, width, height };
  const xTicks = ticksOf(options.x, width / 64);
  picture.append(defs, ...gridLines(frame, options, yTicks), plot, border(frame), front);
  picture.append(xAxis(frame, xTicks, xLabel), yAxis(frame, yTicks, yLabel));
  return frame;
}

function spanOf(axis: AxisOptions): number {
  return Math.abs(axis.domain[1] - axis.domain[0]) || 1;
}

function scaleOf(axis: AxisOptions, from: number, to: number): Scale {
  return axis.log === true ? logScale(axis.domain, from, to) : linearScale(axis.domain, from, to);
}

/** Returns round ticks in the unit that is shown, all with the same number of decimals. */
export function ticksOf(axis: AxisOptions, count: number): Tick[] {
  if (axis.ticks !== undefined) return [...axis.ticks];
  const { factor } = axis.display;
  const [one, other] = [axis.domain[0] * factor, axis.domain[1] * factor];
  const [low, high] = [Math.min(one, other), Math.max(one, other)];
  const many = Math.max(3, Math.floor(count));
  if (axis.log === true) {
    return logTicks(low, high, many).map((tick) => ({ at: tick / factor, text: short(tick, 3) }));
  }
  const few = linearTicks(low, high, many);
  // A round step may leave one or two ticks, from which nobody can read a scale.
  const ticks = few.length < 3 ? linearTicks(low, high, many + 2) : few;
  const step = ticks.length > 1 ? (ticks[1] ?? 0) - (ticks[0] ?? 0) : 1;
  const decimals = stepDecimals(step);
  const large = Math.max(Math.abs(low), Math.abs(high));
  const write = (tick: number): string =>
    large >= 1e5 || large < 1e-3 ? short(tick, 3) : fixed(tick, decimals);
  return ticks.map((tick) => ({ at: tick / factor, text: write(tick) }));
}

function border(frame: Frame): SVGElement {
  const { left, top, width, height } = frame;
  return svg("rect", { class: "frame", x: left, y: top, width, height });
}

function gridLines(frame: Frame, options: FrameOptions, ticks: readonly Tick[]): SVGElement[] {
  if (options.grid !== "y") return [];
  return ticks.map((tick) => {
    const y = frame.y.px(tick.at);
    return svg("line", { class: "grid", x1: frame.left, x2: frame.left + frame.width, y1: y, y2: y });
  });
}

function labelLines(axis: AxisOptions, room: number): string[] {
  return axis.label === "" ? [] : twoLines(labelled(axis.label, axis.display), room);
}

/** Returns text in two lines when it is longer than its room [px]: behind a comma, or before a bracket. */
export function twoLines(text: string, room: number): string[] {
  if (text.length * LETTER <= room) return [text];
  const comma = text.indexOf(", ");
  if (comma >= 0) return [text.slice(0, comma + 1), text.slice(comma + 2)];
  const bracket = text.lastIndexOf(" (");
  return bracket < 0 ? [text] : [text.slice(0, bracket), text.slice(bracket + 1)];
}

function xAxis(frame: Frame, ticks: readonly Tick[], label: readonly string[]): SVGElement {
  const bottom = frame.top + frame.height;
  const group = svg("g", { class: "axis", "aria-hidden": "true" });
  for (const tick of ticks) {
    const x = frame.x.px(tick.at);
    group.append(
      svg("line", { x1: x, x2: x, y1: bottom, y2: bottom + TICK }),
      svg("text", { x, y: bottom + TICK + 12, "text-anchor": "middle" }, tick.text),
    );
  }
  label.forEach((line, index) => {
    const place = { x: frame.left + frame.width / 2, y: bottom + TICK + LINE + 14 + index * LINE };
    group.append(svg("text", { class: "label", "text-anchor": "middle", ...place }, ...richSvg(line)));
  });
  return group;
}

function yAxis(frame: Frame, ticks: readonly Tick[], label: readonly string[]): SVGElement {
  const group = svg("g", { class: "axis", "aria-hidden": "true" });
  for (const tick of ticks) {
    const y = frame.y.px(tick.at);
    group.append(
      svg("line", { x1: frame.left - TICK, x2: frame.left, y1: y, y2: y }),
      svg("text", { x: frame.left - TICK - 3, y: y + 4, "text-anchor": "end" }, tick.text),
    );
  }
  const middle = frame.top + frame.height / 2;
  label.forEach((line, index) => {
    const turned = `translate(${12 + index * LINE} ${middle}) rotate(-90)`;
    group.append(
      svg("text", { class: "label", transform: turned, "text-anchor": "middle" }, ...richSvg(line)),
    );
  });
  return group;
}
