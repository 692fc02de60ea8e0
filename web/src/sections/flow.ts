/** The flow: speed as colour, direction as arrows, filled cells hatched. */

import { type Grid, at, decode, decodeMaybe, extent } from "../arrays";
import { addHatch, cellsPath, drawCells } from "../charts/cells";
import { BAR_ROOM, drawColourBar } from "../charts/colour_bar";
import type { Frame } from "../charts/frame";
import { onPointer } from "../charts/hover";
import { figure } from "../charts/responsive";
import { drawOutline, insideTank, makeTankFrame } from "../charts/tank_frame";
import { colourScale } from "../colours";
import { el, svg } from "../dom";
import type { FlowSection } from "../page";
import { type Readout, legend, readout } from "../parts";
import { cellAt, cellEdges } from "../scale";
import { boxAround } from "../tank/outline";
import { displayFor, inUnit, quantity, short } from "../units";
import { isDark } from "../theme";

const MEASURED = 0;
const FILLED = 1;
const OUTSIDE = 2;
/** Distance between two arrows [px], and their length at the largest speed. */
const ARROW_GAP = 19;
const ARROW_LENGTH = 1.25 * ARROW_GAP;

interface Field {
  readonly x: Grid;
  readonly y: Grid;
  readonly u: Grid;
  readonly v: Grid;
  readonly origin: Grid;
  readonly count: Grid | null;
  readonly error: Grid | null;
  readonly speed: Float64Array;
  readonly xEdges: number[];
  readonly yEdges: number[];
}

export async function drawFlow(section: FlowSection, body: HTMLElement): Promise<void> {
  const field = await decodeField(section);
  const line = readout("Point at the field to read velocities.");
  const { error } = field;
  const holder = el("div", { class: "stack" });
  const beside = el("div", { class: "stack" });
  body.append(el("div", { class: error === null ? "one" : "columns" }, holder, error !== null && beside));
  figure(holder, "square", (width) => drawField(width, section, field, line));
  if (error !== null) figure(beside, "square", (width) => drawError(width, section, field, error, line));
  const some = (kind: number): boolean => field.origin.data.includes(kind);
  holder.append(
    line.element,
    legend([
      ...(some(MEASURED) ? [{ swatch: "line" as const, colour: "var(--ink)", text: "measured" }] : []),
      ...(some(FILLED)
        ? [
            {
              swatch: "hatch" as const,
              colour: "var(--orange)",
              text: "filled in, arrows orange: the block was never there",
            },
          ]
        : []),
    ]),
  );
}

async function decodeField(section: FlowSection): Promise<Field> {
  const [x, y, u, v, origin, count, error] = await Promise.all([
    decode(section.x),
    decode(section.y),
    decode(section.u),
    decode(section.v),
    decode(section.origin),
    decodeMaybe(section.count),
    decodeMaybe(section.standard_error),
  ]);
  const speed = u.data.map((value, index) =>
    at(origin.data, index) === OUTSIDE ? Number.NaN : Math.hypot(value, at(v.data, index)),
  );
  return { x, y, u, v, origin, count, error, speed, xEdges: cellEdges(x.data), yEdges: cellEdges(y.data) };
}

function drawField(width: number, section: FlowSection, field: Field, line: Readout): Element {
  const display = displayFor("m/s", field.speed);
  // A guess must not make what was measured pale.
  const measured = field.speed.map((value, index) =>
    at(field.origin.data, index) === MEASURED ? value : Number.NaN,
  );
  const top = (extent(measured) ?? extent(field.speed))?.[1] ?? 1;
  const frame = makeTankFrame(width, boxAround(section.arena, field.xEdges, field.yEdges), {
    label: `Flow in the tank, up to ${quantity(top, "m/s")}; hatched cells are filled in, not measured`,
    right: BAR_ROOM,
  });
  const columns = field.x.data.length;
  const scale = colourScale("speed", 0, top, { dark: isDark() });
  const inside = insideTank(frame, section.arena);
  drawCells(
    frame,
    field.xEdges,
    field.yEdges,
    (column, row) => scale.of(at(field.speed, row * columns + column)),
    inside,
  );
  drawFilled(frame, field, inside);
  drawArrows(frame, field, top);
  drawOutline(frame, section.arena);
  drawColourBar(frame, { scale, label: `speed (${display.unit})`, display });
  readAt(frame, field, line);
  return frame.svg;
}

/** Draws how well each velocity is known; filled cells are hatched here too. */
function drawError(width: number, section: FlowSection, field: Field, error: Grid, line: Readout): Element {
  const known = error.data.map((value, index) =>
    at(field.origin.data, index) === OUTSIDE ? Number.NaN : value,
  );
  const top =
    extent(known.filter((_, index) => at(field.origin.data, index) === MEASURED))?.[1] ??
    extent(known)?.[1] ??
    1;
  const display = displayFor("m/s", [top]);
  const frame = makeTankFrame(width, boxAround(section.arena, field.xEdges, field.yEdges), {
    label: `Standard error of the flow, up to ${quantity(top, "m/s")} where it is measured`,
    right: BAR_ROOM,
  });
  const columns = field.x.data.length;
  const scale = colourScale("magnitude", 0, top);
  const inside = insideTank(frame, section.arena);
  drawCells(
    frame,
    field.xEdges,
    field.yEdges,
    (column, row) => scale.of(at(known, row * columns + column)),
    inside,
  );
  drawFilled(frame, field, inside);
  drawOutline(frame, section.arena);
  drawColourBar(frame, { scale, label: `standard error (${display.unit})`, display });
  readAt(frame, field, line);
  return frame.svg;
}

function readAt(frame: Frame, field: Field, line: Readout): void {
  onPointer(frame, (place) => {
    const column = place === null ? -1 : cellAt(field.xEdges, place.x);
    const row = place === null ? -1 : cellAt(field.yEdges, place.y);
    line.show(column < 0 || row < 0 ? null : reading(field, row, column));
  });
}

function drawFilled(frame: Frame, field: Field, into: SVGGElement): void {
  const columns = field.x.data.length;
  const cells: [number, number][] = [];
  field.origin.data.forEach((kind, index) => {
    if (kind === FILLED) cells.push([index % columns, Math.floor(index / columns)]);
  });
  const path = cellsPath(frame, field.xEdges, field.yEdges, cells);
  if (path !== "") {
    into.append(svg("path", { d: path, fill: addHatch(frame, { class: "hatch orange", gap: 5 }) }));
  }
}

/** Draws arrows through the centres of cells, thinned so that they do not overlap. */
function drawArrows(frame: Frame, field: Field, top: number): void {
  const columns = field.x.data.length;
  const rows = field.y.data.length;
  const cell = frame.width / Math.max(1, columns);
  const every = Math.max(1, Math.round(ARROW_GAP / cell));
  const paths = { measured: "", filled: "" };
  for (let row = every >> 1; row < rows; row += every) {
    for (let column = every >> 1; column < columns; column += every) {
      const index = row * columns + column;
      const speed = at(field.speed, index);
      if (!(speed > 0)) continue;
      const [x, y] = [frame.x.px(at(field.x.data, column)), frame.y.px(at(field.y.data, row))];
      const length = (ARROW_LENGTH * speed) / top;
      const angle = Math.atan2(-at(field.v.data, index), at(field.u.data, index));
      paths[at(field.origin.data, index) === FILLED ? "filled" : "measured"] += arrowPath(
        x,
        y,
        length,
        angle,
      );
    }
  }
  frame.plot.append(
    svg("path", { class: "arrow", d: paths.measured }),
    svg("path", { class: "arrow filled", d: paths.filled }),
  );
}

/** Returns the data of an arrow whose middle is at (x, y) [px]. */
function arrowPath(x: number, y: number, length: number, angle: number): string {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const point = (along: number, aside: number): string =>
    `${(x + along * cos - aside * sin).toFixed(1)} ${(y + along * sin + aside * cos).toFixed(1)}`;
  const head = Math.min(4.5, 0.45 * length);
  const tip = length / 2;
  return (
    `M${point(-tip, 0)}L${point(tip, 0)}` +
    `M${point(tip - head, -0.55 * head)}L${point(tip, 0)}L${point(tip - head, 0.55 * head)}`
  );
}

function reading(field: Field, row: number, column: number): [string, string][] | null {
  const index = row * field.x.data.length + column;
  const kind = at(field.origin.data, index);
  if (kind === OUTSIDE) return null;
  const display = displayFor("m/s", field.speed);
  const length = displayFor("m", field.x.data);
  const pairs: [string, string][] = [
    ["x", inUnit(at(field.x.data, column), length)],
    ["y", inUnit(at(field.y.data, row), length)],
    ["speed", inUnit(at(field.speed, index), display)],
    ["u", inUnit(at(field.u.data, index), display)],
    ["v", inUnit(at(field.v.data, index), display)],
  ];
  if (field.error !== null && kind === MEASURED) {
    pairs.push(["standard error", inUnit(at(field.error.data, index), display)]);
  }
  if (field.count !== null && kind === MEASURED)
    pairs.push(["samples", short(at(field.count.data, index), 4)]);
  pairs.push(["", kind === FILLED ? "filled in" : "measured"]);
  return pairs;
}
