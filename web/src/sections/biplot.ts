/** Settings on their first two principal components, classes as arrows. */

import { at, decode, extent } from "../arrays";
import { BAR_ROOM, drawColourBar } from "../charts/colour_bar";
import { type Frame, makeFrame } from "../charts/frame";
import { onPointer } from "../charts/hover";
import { figure } from "../charts/responsive";
import { type ColourScale, colourScale, css } from "../colours";
import { type Context, remembered } from "../context";
import { el, svg } from "../dom";
import type { BiplotSection } from "../page";
import { choices, readout } from "../parts";
import { drawSketch, sizeOf, writtenName } from "../polyomino";
import { percent, short } from "../units";

interface Points {
  readonly x: Float64Array;
  readonly y: Float64Array;
  readonly values: ReadonlyMap<string, Float64Array>;
}

type Arrow = BiplotSection["arrows"][number];

const NEAR = 14;
const WORDS: Readonly<Record<string, string>> = {
  complete: "share of runs with one assembly",
  l1_distance: "l1 distance",
};

export async function drawBiplot(section: BiplotSection, body: HTMLElement, context: Context): Promise<void> {
  const [x, y] = await Promise.all([decode(section.points.x), decode(section.points.y)]);
  const values = new Map<string, Float64Array>();
  for (const [name, source] of section.points.values ?? []) values.set(name, (await decode(source)).data);
  const points: Points = { x: x.data, y: y.data, values };
  const names = [...values.keys()];
  const shown = remembered(context, `biplot ${section.id}`, () => ({ name: names[0] ?? "" }));
  const holder = el("div", { class: "one" });
  body.append(holder);
  if (names.length > 1) {
    const options = names.map((name): [string, string] => [name, wordsOf(name)]);
    holder.append(
      choices("Colour of the points", options, shown.name, (name) => {
        shown.name = name;
        chart.redraw();
      }),
    );
  }
  const line = readout("Point at a setting to read it.");
  const chart = figure(holder, "", (width) => drawPlot(width, section, points, shown.name, line.show));
  holder.append(line.element);
}

function wordsOf(name: string): string {
  return WORDS[name] ?? name.replaceAll("_", " ");
}

function drawPlot(
  width: number,
  section: BiplotSection,
  points: Points,
  shown: string,
  show: (parts: [string, string][] | null) => void,
): Element {
  const values = points.values.get(shown);
  const frame = equalFrame(width, section, points, values !== undefined);
  const scale = values === undefined ? null : colourScale("score", ...(extent(values) ?? [0, 1]));
  drawAxes(frame);
  points.x.forEach((x, index) => {
    const dot = svg("circle", {
      class: "dot",
      cx: frame.x.px(x),
      cy: frame.y.px(at(points.y, index)),
      r: 3.4,
    });
    dot.style.setProperty("fill", colourOf(scale, values, index));
    frame.plot.append(dot);
  });
  for (const arrow of section.arrows) drawArrow(frame, arrow);
  if (scale !== null)
    drawColourBar(frame, { scale, label: wordsOf(shown), display: { factor: 1, unit: "" } });
  const mark = svg("circle", { class: "mark", r: 6, visibility: "hidden" });
  frame.front.append(mark);
  onPointer(frame, (place) => {
    const found = place === null ? -1 : nearestPoint(frame, points, place.x, place.y);
    mark.setAttribute("visibility", found < 0 ? "hidden" : "visible");
    if (found < 0) return show(null);
    mark.setAttribute("cx", String(frame.x.px(at(points.x, found))));
    mark.setAttribute("cy", String(frame.y.px(at(points.y, found))));
    const rest = [...points.values].map(([name, list]): [string, string] => [
      wordsOf(name),
      short(at(list, found)),
    ]);
    return show([["", section.points.names[found] ?? ""], ...rest]);
  });
  return frame.svg;
}

function colourOf(scale: ColourScale | null, values: Float64Array | undefined, index: number): string {
  const colour = scale === null || values === undefined ? null : scale.of(at(values, index));
  return colour === null ? "var(--muted)" : css(colour);
}

/** Returns axes with one scale for both. */
function equalFrame(width: number, section: BiplotSection, points: Points, bar: boolean): Frame {
  const arrows = section.arrows;
  const across = extent([0, ...points.x, ...arrows.map((arrow) => arrow.x)]) ?? [-1, 1];
  const up = extent([0, ...points.y, ...arrows.map((arrow) => arrow.y)]) ?? [-1, 1];
  const room = 0.08 * Math.max(across[1] - across[0], up[1] - up[0]) || 1;
  const label = (index: number): string => {
    const axis = section.axes[index];
    if (axis === undefined) return "";
    return axis.share === null ? axis.label : `${axis.label} (${percent(axis.share)} of the variance)`;
  };
  const display = { factor: 1, unit: "" };
  return makeFrame({
    width,
    x: { domain: [across[0] - room, across[1] + room], label: label(0), display },
    // A flat cloud still gets a picture that is high enough for its arrows.
    y: {
      domain: heightened(
        [up[0] - room, up[1] + room],
        (width < 500 ? 0.95 : 0.5) * (across[1] - across[0] + 2 * room),
      ),
      label: label(1),
      display,
    },
    ...(bar ? { right: BAR_ROOM } : {}),
    label: `Biplot of ${points.x.length} settings; arrows: ${arrows.map((arrow) => arrow.name).join(", ")}`,
  });
}

function heightened([low, high]: [number, number], least: number): [number, number] {
  const lack = Math.max(0, least - (high - low)) / 2;
  return [low - lack, high + lack];
}

function drawAxes(frame: Frame): void {
  const [x, y] = [frame.x.px(0), frame.y.px(0)];
  frame.plot.append(
    svg("line", { class: "zero", x1: frame.left, x2: frame.left + frame.width, y1: y, y2: y }),
    svg("line", { class: "zero", x1: x, x2: x, y1: frame.top, y2: frame.top + frame.height }),
  );
}

function drawArrow(frame: Frame, arrow: Arrow): void {
  const [x0, y0, x1, y1] = [frame.x.px(0), frame.y.px(0), frame.x.px(arrow.x), frame.y.px(arrow.y)];
  const length = Math.hypot(x1 - x0, y1 - y0);
  if (length < 1) return;
  const [cos, sin] = [(x1 - x0) / length, (y1 - y0) / length];
  const head = Math.min(7, length);
  const side = (aside: number): string =>
    `${(x1 - head * cos - aside * head * sin).toFixed(1)} ${(y1 - head * sin + aside * head * cos).toFixed(1)}`;
  frame.plot.append(
    svg("path", { class: "loading", d: `M${x0} ${y0}L${x1} ${y1}M${side(0.45)}L${x1} ${y1}L${side(-0.45)}` }),
  );
  // Short arrows lie in a heap whose labels nobody could read.
  if (length < 22) return;
  drawArrowName(frame, arrow, x1 + 8 * cos, y1 + 8 * sin, cos, sin);
}

function drawArrowName(frame: Frame, { name, cells }: Arrow, x: number, y: number, cos: number, sin: number): void {
  const written = writtenName(name);
  const anchor = cos > 0.3 ? "start" : cos < -0.3 ? "end" : "middle";
  if (written !== "") {
    const text = svg("text", { class: "halo", x, y: y + 4 + 4 * sin, "text-anchor": anchor }, written);
    frame.front.append(text);
    return;
  }
  const side = 4;
  const sketch = sizeOf(cells);
  const left = x - (anchor === "start" ? 0 : anchor === "end" ? 1 : 0.5) * sketch.width * side;
  frame.front.append(drawSketch(cells, left, y - ((1 - sin) / 2) * sketch.height * side, side));
}

function nearestPoint(frame: Frame, points: Points, x: number, y: number): number {
  let best = -1;
  let closest = NEAR;
  points.x.forEach((px, index) => {
    const gap = Math.hypot(frame.x.px(px) - frame.x.px(x), frame.y.px(at(points.y, index)) - frame.y.px(y));
    if (gap < closest) [best, closest] = [index, gap];
  });
  return best;
}
