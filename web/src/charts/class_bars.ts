/** Horizontal bars of the outcome classes, with whiskers and sketches. */

import { isComplete } from "../colours";
import { svg } from "../dom";
import { type Square, drawSketch, sizeOf, writtenName } from "../polyomino";
import { linearScale, linearTicks } from "../scale";
import { percent } from "../units";

export interface ClassBar {
  readonly share: number;
  readonly low: number | null;
  readonly high: number | null;
  readonly count: number | null;
  readonly colour: string;
}

export interface ClassRow {
  readonly name: string;
  readonly cells: readonly Square[];
  readonly note: string | null;
  /** One bar per series; null where a series does not have the class. */
  readonly bars: readonly (ClassBar | null)[];
}

const BAR = 13;
const GAP = 11;
const SQUARE = 7;
const LETTER = 7.3;
/** Width of the text behind a bar: share and interval. */
const TEXT = 150;
const NARROW_TEXT = 50;

/** Draws one row per class; `label` says what the picture shows. */
export function drawClassBars(width: number, rows: readonly ClassRow[], label: string): SVGSVGElement {
  const wide = width > 520;
  const sizes = rows.map((row) => sizeOf(row.cells));
  const sketchWidth = Math.max(0, ...sizes.map((size) => size.width * SQUARE));
  const nameWidth = Math.max(0, ...rows.map((row) => writtenName(row.name).length * LETTER));
  const left = sketchWidth + nameWidth + 24;
  const text = wide ? TEXT : NARROW_TEXT;
  const right = Math.max(left + 60, width - text);
  const highest = Math.max(
    0.01,
    ...rows.flatMap((row) => row.bars.map((bar) => Math.max(bar?.share ?? 0, bar?.high ?? 0))),
  );
  const scale = linearScale([0, highest], left, right - 8);

  const picture = svg("svg", { class: "plot classes", role: "img", "aria-label": label });
  const grid = svg("g", { class: "axis", "aria-hidden": "true" });
  picture.append(grid);
  let top = 4;
  rows.forEach((row, index) => {
    if (index > 0 && isComplete(rows[index - 1]?.name ?? "") && !isComplete(row.name)) {
      picture.append(svg("line", { class: "divide", x1: 0, x2: width, y1: top, y2: top }));
      top += GAP / 2 + 2;
    }
    const sketch = sizes[index] ?? { width: 0, height: 0 };
    const height = Math.max(row.bars.length * BAR, sketch.height * SQUARE);
    const middle = top + height / 2;
    picture.append(
      drawSketch(row.cells, sketchWidth - sketch.width * SQUARE, middle - (sketch.height * SQUARE) / 2, SQUARE),
    );
    picture.append(svg("text", { x: sketchWidth + 9, y: middle + 4 }, writtenName(row.name)));
    const first = middle - (row.bars.length * BAR) / 2;
    row.bars.forEach((bar, place) => {
      if (bar !== null) picture.append(drawBar(bar, scale.px, first + place * BAR, wide));
    });
    if (row.note !== null && wide) {
      picture.append(
        svg("text", { class: "remark", x: width, y: middle + 4, "text-anchor": "end" }, row.note),
      );
    }
    top += height + GAP;
  });
  for (const tick of linearTicks(0, highest, Math.max(2, (right - left) / 90))) {
    const x = scale.px(tick);
    grid.append(
      svg("line", { class: "grid", x1: x, x2: x, y1: 0, y2: top }),
      svg("text", { x, y: top + 14, "text-anchor": "middle" }, percent(tick)),
    );
  }
  grid.append(
    svg(
      "text",
      { class: "label", x: (left + right) / 2, y: top + 34, "text-anchor": "middle" },
      "share of runs",
    ),
  );
  const total = top + 42;
  picture.setAttribute("viewBox", `0 0 ${width} ${total}`);
  picture.setAttribute("width", String(width));
  picture.setAttribute("height", String(total));
  return picture;
}

function drawBar(bar: ClassBar, px: (share: number) => number, top: number, wide: boolean): SVGGElement {
  const group = svg("g");
  const [start, end, middle] = [px(0), px(bar.share), top + BAR / 2];
  const rect = svg("rect", {
    class: "class-bar",
    x: start,
    y: top + 1,
    width: Math.max(0, end - start),
    height: BAR - 2,
  });
  rect.style.setProperty("fill", bar.colour);
  group.append(rect);
  let reach = end;
  let interval = "";
  if (bar.low !== null && bar.high !== null) {
    const [low, high] = [px(bar.low), px(bar.high)];
    reach = Math.max(reach, high);
    interval = ` (${percent(bar.low, 2).replace(" %", "")} to ${percent(bar.high, 2)})`;
    const d = `M${low} ${middle}H${high}M${low} ${middle - 3}V${middle + 3}M${high} ${middle - 3}V${middle + 3}`;
    group.append(svg("path", { class: "whisker", d }));
  }
  const share = svg("text", { x: reach + 7, y: middle + 4 }, percent(bar.share));
  if (wide && interval !== "") share.append(svg("tspan", { class: "remark" }, interval));
  group.append(share);
  return group;
}
