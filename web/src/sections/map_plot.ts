/** The map of 1 − D itself: cells, failures, region, found point, selected cell. */

import { extent } from "../arrays";
import { addHatch, cellsPath, drawCells } from "../charts/cells";
import { BAR_ROOM, drawColourBar } from "../charts/colour_bar";
import { type Frame, makeFrame } from "../charts/frame";
import { type Place, onPointer } from "../charts/hover";
import { type ColourScale, colourScale } from "../colours";
import { svg } from "../dom";
import type { Cell } from "../keyboard";
import { closedPath } from "../tank/outline";
import { spoken } from "../symbols";
import { type MapData, distanceAt, failureAt } from "./map_data";

const PLAIN = { factor: 1, unit: "" } as const;
/** Slants of the hatches of different reasons [°]. */
const SLANTS = [45, -45, 0, 90] as const;

export type View = "whole" | "refined";

interface MapLook {
  readonly selected: Cell | null;
  readonly cursor: Cell | null;
  readonly pointed: (place: Place | null) => void;
  readonly pressed: (place: Place) => void;
}

/** Draws the whole box that was searched, or the surface near the optimum with colours of its own. */
export function drawPart(width: number, map: MapData, view: View, look: MapLook): Element {
  const scale = view === "whole" ? colourScale("score", 0, 1) : ownScale(map);
  const frame = mapFrame(width, map, map.xEdges, map.yEdges);
  drawCells(frame, map.xEdges, map.yEdges, (column, row) => scale.of(1 - distanceAt(map, row, column)));
  drawFailures(frame, map);
  drawRegion(frame, map);
  drawChosen(frame, map, look.cursor, "cursor");
  drawChosen(frame, map, look.selected, "selected");
  drawBest(frame, map);
  drawFound(frame, map);
  drawBar(frame, map, scale);
  onPointer(frame, look.pointed, look.pressed);
  return frame.svg;
}

/** Returns colours from the lowest score to the highest, or to that of the noise floor. */
function ownScale(map: MapData): ColourScale {
  const [low, high] = extent(map.distance.data.map((distance) => 1 - distance)) ?? [0, 1];
  const floor = map.section.noise_floor;
  return colourScale("score", low, Math.max(high, floor === null ? high : Math.min(1, 1 - 0.9 * floor)));
}

/** Returns the reasons of failures that occur, in the order of their number, with their cells. */
export function failures(map: MapData): Map<string, [number, number][]> {
  const reasons = new Map<string, [number, number][]>();
  for (let row = 0; row < map.rows; row += 1) {
    for (let column = 0; column < map.columns; column += 1) {
      const reason = failureAt(map, row, column);
      if (reason === null) continue;
      reasons.set(reason, [...(reasons.get(reason) ?? []), [column, row]]);
    }
  }
  return reasons;
}

function mapFrame(width: number, map: MapData, xEdges: number[], yEdges: number[]): Frame {
  const { x, y } = map.section;
  const inner = width - BAR_ROOM - 52;
  return makeFrame({
    width,
    height: Math.min(430, Math.max(180, inner * 0.92)),
    x: { domain: ends(xEdges), label: x.label, display: map.xDisplay },
    y: { domain: ends(yEdges), label: y.label, display: map.yDisplay },
    right: BAR_ROOM,
    label: `Map of 1 − D over ${spoken(x.label)} and ${spoken(y.label)}`,
  });
}

function ends(edges: number[]): [number, number] {
  return [edges[0] ?? 0, edges.at(-1) ?? 1];
}

function drawFailures(frame: Frame, map: MapData): void {
  let index = 0;
  for (const cells of failures(map).values()) {
    const hatch = addHatch(frame, { slant: SLANTS[index % SLANTS.length] ?? 45, gap: 6, paper: true });
    const path = cellsPath(frame, map.xEdges, map.yEdges, cells);
    frame.plot.append(svg("path", { class: "failed", d: path, fill: hatch }));
    index += 1;
  }
}

function drawRegion(frame: Frame, map: MapData): void {
  const { region } = map.section;
  if (region === null) return;
  const corners = region.x.map((x, index): [number, number] => [x, region.y[index] ?? Number.NaN]);
  const d = closedPath(corners, frame.x.px, frame.y.px);
  frame.plot.append(svg("path", { class: "region edge", d }), svg("path", { class: "region", d }));
}

function drawBest(frame: Frame, map: MapData): void {
  const { best } = map.section;
  if (best === null) return;
  const [x, y] = [frame.x.px(best.x), frame.y.px(best.y)];
  frame.front.append(
    svg("path", { class: "best", d: `M${x} ${y - 5}L${x + 5} ${y}L${x} ${y + 5}L${x - 5} ${y}Z` }),
  );
}

function drawFound(frame: Frame, map: MapData): void {
  const { found } = map.section;
  if (found === null) return;
  frame.front.append(
    svg("circle", { class: "found", cx: frame.x.px(found.x), cy: frame.y.px(found.y), r: 5 }),
  );
}

function drawChosen(frame: Frame, map: MapData, cell: Cell | null, name: string): void {
  if (cell === null) return;
  const d = cellsPath(frame, map.xEdges, map.yEdges, [[cell.column, cell.row]]);
  frame.front.append(svg("path", { class: `${name} edge`, d }), svg("path", { class: name, d }));
}

function drawBar(frame: Frame, map: MapData, scale: ColourScale): void {
  const { noise_floor: floor } = map.section;
  const marks = floor === null ? [] : [{ at: 1 - floor, label: "noise floor" }];
  drawColourBar(frame, { scale, label: "score 1 − D", display: PLAIN, marks });
}
