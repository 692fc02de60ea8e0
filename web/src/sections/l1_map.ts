/** The l1 distance to the reference over two axes; a click shows the classes of a setting, over time too. */

import { type Grid, at, decode, decodeMaybe, extent, nearest, part } from "../arrays";
import { addHatch, cellsPath, drawCells } from "../charts/cells";
import { drawClassBars } from "../charts/class_bars";
import { BAR_ROOM, drawColourBar } from "../charts/colour_bar";
import { contourLine, contourPath } from "../charts/contour";
import { makeFrame } from "../charts/frame";
import { type Place, onPointer } from "../charts/hover";
import { figure } from "../charts/responsive";
import { colourScale } from "../colours";
import { type Context, remembered } from "../context";
import { el, refill, svg } from "../dom";
import type { Cell } from "../keyboard";
import type { L1MapSection } from "../page";
import { type Swatch, details, legend, readout, starPath, table } from "../parts";
import { cellAt, cellEdges } from "../scale";
import { rich, shortName, spoken } from "../symbols";
import { type Display, displayFor, inUnit, percent, short } from "../units";
import { useGridKeys } from "./grid_keys";
import { drawSettingTimes, timesSource } from "./setting_times";

interface L1Data {
  readonly section: L1MapSection;
  readonly value: Float64Array;
  readonly shares: Grid | null;
  readonly rows: number;
  readonly columns: number;
  readonly xEdges: number[];
  readonly yEdges: number[];
  readonly xDisplay: Display;
  readonly yDisplay: Display;
}

export async function drawL1Map(section: L1MapSection, body: HTMLElement, context: Context): Promise<void> {
  const map = await decodeL1(section);
  const choice = remembered(context, `l1 ${section.id}`, (): { selected: Cell | null } => ({
    selected: null,
  }));
  let cursor: Cell | null = null;
  const first = choice.selected ?? startCell(map);
  const grid = el("div", { class: "map", "data-part": "l1-map" });
  const shown = el("div", { class: "map-plot" });
  const panel = el("div", { class: "map-setting" });
  const below = el("div", { class: "setting-times" });
  grid.append(shown, panel, below);
  body.append(grid);
  const more = map.shares !== null || section.over_time !== null || context.fetchCell !== null;
  const hint = `Point at a cell to read it${more ? "; click it to see its outcomes" : ""}.`;
  const line = readout(hint);
  line.element.setAttribute("aria-live", "polite");

  const show = settingPanel(map, panel, below, grid, context);
  const select = (cell: Cell): void => {
    choice.selected = cell;
    plot.redraw();
    void show(cell);
  };
  const moved = (cell: Cell | null): void => {
    cursor = cell;
    plot.redraw();
    line.show(cell === null ? null : reading(map, cell));
  };
  const plot = figure(shown, "map-figure", (width) =>
    drawPlot(width, map, choice.selected ?? first, cursor, {
      pointed: (place) => {
        const cell = place === null ? null : cellUnder(map, place);
        line.show(cell === null ? null : reading(map, cell));
      },
      pressed: (place) => {
        const cell = cellUnder(map, place);
        if (cell !== null) select(cell);
      },
    }),
  );
  useGridKeys(plot.element, {
    label: `Map of the ${section.label}`,
    size: () => map,
    here: () => choice.selected ?? first,
    cursor: () => cursor,
    moved,
    select,
  });
  shown.append(
    line.element,
    mapLegend(map),
    details("Values as a table", () => valueTable(map)),
  );
  await show(first);
}

async function decodeL1(section: L1MapSection): Promise<L1Data> {
  const [value, shares] = await Promise.all([decode(section.value), decodeMaybe(section.shares)]);
  const { x, y } = section;
  return {
    section,
    value: value.data,
    shares,
    rows: y.values.length,
    columns: x.values.length,
    xEdges: cellEdges(x.values),
    yEdges: cellEdges(y.values),
    xDisplay: displayFor(x.unit, x.values),
    yDisplay: displayFor(y.unit, y.values),
  };
}

function startCell(map: L1Data): Cell {
  const { reference, x, y } = map.section;
  if (reference !== null)
    return { row: nearest(y.values, reference.y), column: nearest(x.values, reference.x) };
  const lowest = extent(map.value)?.[0];
  const index = lowest === undefined ? 0 : map.value.indexOf(lowest);
  return { row: Math.floor(index / map.columns), column: index % map.columns };
}

function cellUnder(map: L1Data, place: Place): Cell | null {
  const [column, row] = [cellAt(map.xEdges, place.x), cellAt(map.yEdges, place.y)];
  return row < 0 || column < 0 ? null : { row, column };
}

function drawPlot(
  width: number,
  map: L1Data,
  selected: Cell,
  cursor: Cell | null,
  pointer: { pointed: (place: Place | null) => void; pressed: (place: Place) => void },
): Element {
  const { x, y, noise, reference } = map.section;
  const inner = width - BAR_ROOM - 52;
  const frame = makeFrame({
    width,
    height: Math.min(430, Math.max(180, inner * 0.92)),
    x: { domain: ends(map.xEdges), label: x.label, display: map.xDisplay },
    y: { domain: ends(map.yEdges), label: y.label, display: map.yDisplay },
    right: BAR_ROOM,
    label: `Map of the ${map.section.label} over ${spoken(x.label)} and ${spoken(y.label)}`,
  });
  const top = extent(map.value)?.[1] ?? 2;
  const scale = colourScale("distance", 0, top);
  drawCells(frame, map.xEdges, map.yEdges, (column, row) =>
    scale.of(at(map.value, row * map.columns + column)),
  );
  const missing: [number, number][] = [];
  map.value.forEach((value, index) => {
    if (!Number.isFinite(value)) missing.push([index % map.columns, Math.floor(index / map.columns)]);
  });
  const gaps = cellsPath(frame, map.xEdges, map.yEdges, missing);
  if (gaps !== "") frame.plot.append(svg("path", { d: gaps, fill: addHatch(frame, { gap: 6 }) }));
  if (noise !== null) {
    const d = contourPath(contourLine(x.values, y.values, map.value, noise), frame.x.px, frame.y.px);
    frame.plot.append(svg("path", { class: "region edge", d }), svg("path", { class: "region", d }));
  }
  for (const [cell, name] of [
    [cursor, "cursor"],
    [selected, "selected"],
  ] as const) {
    if (cell === null) continue;
    const d = cellsPath(frame, map.xEdges, map.yEdges, [[cell.column, cell.row]]);
    frame.front.append(svg("path", { class: `${name} edge`, d }), svg("path", { class: name, d }));
  }
  if (reference !== null) {
    const d = starPath(frame.x.px(reference.x), frame.y.px(reference.y), 8);
    frame.front.append(svg("path", { class: "reference", d }));
  }
  const marks = noise === null ? [] : [{ at: noise, label: "noise floor" }];
  drawColourBar(frame, { scale, label: map.section.label, display: { factor: 1, unit: "" }, marks });
  onPointer(frame, pointer.pointed, pointer.pressed);
  return frame.svg;
}

function ends(edges: number[]): [number, number] {
  return [edges[0] ?? 0, edges.at(-1) ?? 1];
}

function reading(map: L1Data, { row, column }: Cell): [string, string][] {
  const { x, y, label } = map.section;
  return [
    [shortName(x.label), inUnit(at(x.values, column), map.xDisplay, 4)],
    [shortName(y.label), inUnit(at(y.values, row), map.yDisplay, 4)],
    [label, short(distanceAt(map, { row, column }))],
  ];
}

/** Returns what shows a setting in the panel; of several calls the last one counts. */
function settingPanel(
  map: L1Data,
  panel: HTMLElement,
  below: HTMLElement,
  grid: HTMLElement,
  context: Context,
): (cell: Cell) => Promise<void> {
  const source = timesSource(map.section, context);
  let newest = 0;
  return async (cell) => {
    newest += 1;
    const mine = newest;
    const times = await source(cell).catch(() => null);
    if (mine !== newest) return;
    const waits = context.fetchCell !== null && !Number.isFinite(distanceAt(map, cell));
    const nothing = waits
      ? "This setting has no outcomes yet."
      : "There are no outcomes of this setting.";
    const some = showSetting(map, panel, grid, cell, nothing);
    refill(below, () => {
      if (times !== null && some) {
        below.append(el("h3", {}, "Outcome classes over time"));
        drawSettingTimes(below, times, context);
      } else if (some) {
        const words = "This run kept no outcome classes over time; a new run keeps them.";
        below.append(el("p", { class: "nothing" }, waits ? nothing : words));
      }
    });
    grid.dataset["shown"] = `${cell.row},${cell.column}`;
  };
}

function distanceAt(map: L1Data, { row, column }: Cell): number {
  return at(map.value, row * map.columns + column);
}

/** Shows the outcomes of a setting at the end of its runs; returns false where it is known to have none. */
function showSetting(
  map: L1Data,
  panel: HTMLElement,
  grid: HTMLElement,
  cell: Cell,
  nothing: string,
): boolean {
  const { section, shares } = map;
  const distance = distanceAt(map, cell);
  Object.assign(grid.dataset, {
    row: String(cell.row),
    column: String(cell.column),
    value: Number.isFinite(distance) ? String(distance) : "",
  });
  const title = reading(map, cell)
    .slice(0, 2)
    .flatMap(([label, value], index) => [index > 0 && ", ", ...rich(label), ` = ${value}`]);
  const words = Number.isFinite(distance) ? `${section.label} ${short(distance)}` : "not computed";
  panel.replaceChildren(el("div", { class: "setting-head" }, el("h3", {}, ...title), el("p", {}, words)));
  if (shares === null) return true;
  const found = part(shares, cell.row, cell.column);
  const rows = section.classes.map((name, index) => ({
    name,
    cells: section.cells[index] ?? [],
    note: null,
    bars: [{ share: at(found, index), low: null, high: null, count: null, colour: "var(--blue)" }],
  }));
  const known = rows.filter((row) => Number.isFinite(row.bars[0]?.share));
  if (known.length === 0) {
    panel.append(el("p", { class: "nothing" }, nothing));
    return false;
  }
  const label = known.map((row) => `${row.name} ${percent(row.bars[0]?.share ?? 0)}`).join(", ");
  figure(panel, "", (width) => drawClassBars(width, known, `Outcomes of this setting: ${label}`));
  return true;
}

function mapLegend(map: L1Data): HTMLElement {
  const items: { swatch: Swatch; colour?: string; text: string }[] = [
    { swatch: "box", colour: "#d55e00", text: "selected" },
  ];
  if (map.section.reference !== null) items.push({ swatch: "star", colour: "#d55e00", text: "reference" });
  if (map.section.noise !== null)
    items.push({ swatch: "line", text: `noise floor (${short(map.section.noise)})` });
  if (map.value.some((value) => !Number.isFinite(value)))
    items.push({ swatch: "hatch", text: "not computed" });
  return legend(items);
}

function valueTable(map: L1Data): HTMLElement {
  const { x, y } = map.section;
  return table(
    map.section.title,
    [
      `${spoken(y.label)} \\ ${spoken(x.label)}`,
      ...x.values.map((value) => short(value * map.xDisplay.factor, 4)),
    ],
    y.values.map((value, row) => [
      short(value * map.yDisplay.factor, 4),
      ...x.values.map((_, column) => short(at(map.value, row * map.columns + column))),
    ]),
    () => true,
  );
}
