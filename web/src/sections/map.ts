/** The map of 1 − D: hover reads, a click or Enter selects, the selected setting is shown beside. */

import type { Place } from "../charts/hover";
import { figure } from "../charts/responsive";
import { type Context, remembered } from "../context";
import { type Child, el, refill } from "../dom";
import type { Cell } from "../keyboard";
import type { MapSection } from "../page";
import { type Swatch, choices, details, legend, readout, table } from "../parts";
import { cellAt } from "../scale";
import { rich, shortName, spoken } from "../symbols";
import { inUnit, labelled, percent, short } from "../units";
import { useGridKeys } from "./grid_keys";
import {
  type MapData,
  cellNear,
  decodeMap,
  decodeRefined,
  distanceAt,
  errorAt,
  excerptSource,
  failureAt,
  placeOf,
} from "./map_data";
import { type View, drawPart, failures } from "./map_plot";
import { decodeRecorded, drawSetting } from "./map_setting";

interface Choice {
  readonly selected: Record<View, Cell | null>;
  view: View;
}

export async function drawMap(section: MapSection, body: HTMLElement, context: Context): Promise<void> {
  const map = await decodeMap(section);
  const refined = await decodeRefined(map);
  const choice = remembered<Choice>(context, `map ${section.id}`, () => ({
    selected: { whole: null, refined: null },
    view: "whole",
  }));
  if (refined === null) choice.view = "whole";
  const now = (): MapData => (choice.view === "refined" && refined !== null ? refined : map);
  const shown = el("div", { class: "map-plot" });
  const panel = el("div", { class: "map-setting", "aria-live": "off" });
  const grid = el("div", { class: "map", "data-part": "map" }, shown, panel);
  body.append(grid);

  const line = readout("Point at a cell to read it; click it to see its motion.");
  line.element.setAttribute("aria-live", "polite");
  const showSetting = settingPanel(map, panel, context);
  let cursor: Cell | null = null;
  // What is shown at first follows a sweep as its map fills, until the reader chooses.
  const first = { whole: startCell(map), refined: refined === null ? null : startCell(refined) };
  const selected = (): Cell | null => {
    const kept = choice.selected[choice.view];
    // The surface near the optimum may have moved since, and have fewer cells.
    const there = kept !== null && kept.row < now().rows && kept.column < now().columns;
    return there ? kept : first[choice.view];
  };

  const show = async (cell: Cell | null): Promise<void> => {
    if (cell === null) return;
    grid.dataset["view"] = choice.view;
    mark(grid, now(), cell);
    await showSetting(now(), cell);
  };
  const select = (cell: Cell): void => {
    choice.selected[choice.view] = cell;
    plot.redraw();
    void show(cell);
  };
  const pointed = (place: Place | null): void => {
    const cell = place === null ? null : cellUnder(now(), place);
    line.show(cell === null ? null : reading(now(), cell));
  };

  if (refined !== null) {
    const views = [
      ["whole", "whole box"],
      ["refined", "near the optimum"],
    ] as const;
    shown.append(
      choices("Part of the map", views, choice.view, (view) => {
        choice.view = view;
        cursor = null;
        plot.redraw();
        line.show(null);
        fillBelow();
        void show(selected());
      }),
    );
  }
  const plot = figure(shown, "map-figure", (width) =>
    drawPart(width, now(), choice.view, {
      selected: selected(),
      cursor,
      pointed,
      pressed: (place) => {
        const cell = cellUnder(now(), place);
        if (cell !== null) select(cell);
      },
    }),
  );
  const moved = (cell: Cell | null): void => {
    cursor = cell;
    plot.redraw();
    line.show(cell === null ? null : reading(now(), cell));
  };
  useGridKeys(plot.element, {
    label: "Map of 1 − D",
    size: now,
    here: () => selected() ?? { row: 0, column: 0 },
    cursor: () => cursor,
    moved,
    select,
  });
  const below = el("div");
  const fillBelow = (): void => {
    const open = below.querySelector("details")?.open ?? false;
    const values = details("Values as a table", () => valueTable(now()));
    values.open = open;
    below.replaceChildren(mapLegend(now()), values);
  };
  fillBelow();
  shown.append(line.element, below);

  if (selected() === null) {
    panel.append(el("p", { class: "nothing" }, "No setting has been computed yet."));
    return;
  }
  await show(selected());
}

/** Returns the cell nearest to the best one, or to what was found. */
function startCell(map: MapData): Cell | null {
  const wanted = map.section.best ?? map.section.found;
  return wanted === null ? null : cellNear(map, wanted);
}

function cellUnder(map: MapData, place: Place): Cell | null {
  const [column, row] = [cellAt(map.xEdges, place.x), cellAt(map.yEdges, place.y)];
  return row < 0 || column < 0 ? null : { row, column };
}

/** Leaves what is selected where a script or a test can read it. */
function mark(element: HTMLElement, map: MapData, { row, column }: Cell): void {
  const distance = distanceAt(map, row, column);
  const error = errorAt(map, row, column);
  Object.assign(element.dataset, {
    row: String(row),
    column: String(column),
    value: Number.isFinite(distance) ? String(distance) : "",
    standardError: Number.isFinite(error) ? String(error) : "",
    x: String(map.section.x.values[column]),
    y: String(map.section.y.values[row]),
    failure: failureAt(map, row, column) ?? "",
  });
}

type Pairs = [label: string, value: string][];

function settingPairs(map: MapData, { row, column }: Cell): Pairs {
  const { x, y } = map.section;
  return [
    [shortName(x.label), inUnit(x.values[column] ?? Number.NaN, map.xDisplay, 4)],
    [shortName(y.label), inUnit(y.values[row] ?? Number.NaN, map.yDisplay, 4)],
  ];
}

function reading(map: MapData, cell: Cell): Pairs {
  const pairs = settingPairs(map, cell);
  const distance = distanceAt(map, cell.row, cell.column);
  const failure = failureAt(map, cell.row, cell.column);
  if (Number.isFinite(distance)) {
    const error = errorAt(map, cell.row, cell.column);
    const spread = Number.isFinite(error) ? ` ± ${short(error, 2)}` : "";
    pairs.push(["1 − D", `${short(1 - distance, 3)}${spread}`]);
  }
  if (failure !== null) pairs.push(["", failure]);
  return pairs;
}

/**
 * Returns what shows a setting of a part of the map in the panel; of several calls the last one counts.
 * Motion was kept of the settings of the whole box alone: one near the optimum shows that of the nearest.
 */
function settingPanel(
  map: MapData,
  panel: HTMLElement,
  context: Context,
): (part: MapData, cell: Cell) => Promise<void> {
  const source = excerptSource(map, context);
  const recorded = decodeRecorded(map);
  let newest = 0;
  return async (part, cell) => {
    newest += 1;
    const mine = newest;
    const near = part === map ? cell : cellNear(map, placeOf(part, cell));
    const excerpt =
      source === null || near === null ? null : await source(near.row, near.column).catch(() => null);
    const beside = await recorded;
    if (mine !== newest) return;
    refill(panel, () => {
      panel.append(settingHead(part, cell));
      if (excerpt === null) panel.append(el("p", { class: "nothing" }, "No motion of this setting was kept."));
      else {
        if (part !== map && near !== null) {
          const words = "The motion is that of the nearest setting of the whole box, ";
          panel.append(el("p", {}, words, ...settingWords(map, near), "."));
        }
        drawSetting(panel, map, beside, excerpt, part === map ? "this setting" : "the nearest setting");
      }
    });
    panel.dataset["shown"] = `${cell.row},${cell.column}`;
  };
}

/** Returns a setting in words: "C_d = 0.4, σ_F = 0.6 mN". */
function settingWords(map: MapData, cell: Cell): Child[] {
  return settingPairs(map, cell).flatMap(([label, value], index) => [
    index > 0 && ", ",
    ...rich(label),
    ` = ${value}`,
  ]);
}

function settingHead(map: MapData, cell: Cell): HTMLElement {
  const distance = distanceAt(map, cell.row, cell.column);
  const error = errorAt(map, cell.row, cell.column);
  const failure = failureAt(map, cell.row, cell.column);
  const spread = Number.isFinite(error) ? ` ± ${short(error, 2)}` : "";
  return el(
    "div",
    { class: "setting-head" },
    el("h3", {}, ...settingWords(map, cell)),
    el(
      "p",
      {},
      Number.isFinite(distance) && `1 − D = ${short(1 - distance, 3)}${spread}`,
      failure !== null &&
        el("strong", { class: "failure" }, Number.isFinite(distance) ? ` (${failure})` : failure),
    ),
  );
}

function mapLegend(map: MapData): HTMLElement {
  const { section } = map;
  const items: { swatch: Swatch; colour?: string; text: string }[] = [
    { swatch: "box", colour: "var(--orange)", text: "selected" },
  ];
  if (section.found !== null) items.push({ swatch: "ring", text: "found" });
  if (section.best !== null) items.push({ swatch: "diamond", text: "best cell" });
  if (section.region !== null) {
    const { confidence } = section.region;
    items.push({ swatch: "line", text: `${confidence === null ? "" : `${percent(confidence)} `}region` });
  }
  for (const reason of failures(map).keys()) items.push({ swatch: "hatch", text: reason });
  const list = legend(items);
  if (section.noise_floor !== null) {
    const upper = section.noise_floor_upper;
    const reach = upper === null ? "" : `, ${short(1 - upper, 3)} is still likely`;
    list.append(
      el(
        "li",
        { class: "wide" },
        `Line in the colour bar: two runs of one model reach ${short(1 - section.noise_floor, 3)} (noise floor${reach}).`,
      ),
    );
  }
  return list;
}

function valueTable(map: MapData): HTMLElement {
  const { x, y } = map.section;
  const corner = `${spoken(labelled(y.label, map.yDisplay))} \\ ${spoken(labelled(x.label, map.xDisplay))}`;
  const rows = y.values.map((value, row) => [
    short(value * map.yDisplay.factor, 4),
    ...x.values.map(
      (_, column) => failureText(map, row, column) ?? short(1 - distanceAt(map, row, column), 3),
    ),
  ]);
  const heads = x.values.map((value) => short(value * map.xDisplay.factor, 4));
  return table("Values of 1 − D", [corner, ...heads], rows, () => true);
}

function failureText(map: MapData, row: number, column: number): string | null {
  return Number.isFinite(distanceAt(map, row, column)) ? null : failureAt(map, row, column);
}
