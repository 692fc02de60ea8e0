/** The map of 1 − D, decoded, and what is kept of its settings. */

import { type Grid, at, decode, decodeMaybe, nearest, part } from "../arrays";
import type { CellExcerpt, Context } from "../context";
import type { Cell } from "../keyboard";
import type { MapSection } from "../page";
import { cellEdges } from "../scale";
import { type Display, displayFor } from "../units";

export interface MapData {
  readonly section: MapSection;
  readonly distance: Grid;
  readonly error: Grid | null;
  readonly status: Grid | null;
  readonly rows: number;
  readonly columns: number;
  readonly xEdges: number[];
  readonly yEdges: number[];
  readonly xDisplay: Display;
  readonly yDisplay: Display;
}

/** What a reader sees of one setting beside the recording. */
export interface Excerpt {
  /** Empty when no path was kept. */
  readonly x: ArrayLike<number>;
  readonly y: ArrayLike<number>;
  readonly time: Grid | null;
  readonly density: Grid | null;
  readonly ksStepLength: number;
  readonly ksTurningAngle: number;
}

export async function decodeMap(section: MapSection): Promise<MapData> {
  const [distance, error, status] = await Promise.all([
    decode(section.value),
    decodeMaybe(section.standard_error),
    decodeMaybe(section.status),
  ]);
  return {
    section,
    distance,
    error,
    status,
    rows: section.y.values.length,
    columns: section.x.values.length,
    xEdges: cellEdges(section.x.values),
    yEdges: cellEdges(section.y.values),
    xDisplay: displayFor(section.x.unit, section.x.values),
    yDisplay: displayFor(section.y.unit, section.y.values),
  };
}

/** Returns the surface near the optimum as a map of its own, null where there is none. */
export async function decodeRefined(map: MapData): Promise<MapData | null> {
  const { section } = map;
  const { refined } = section;
  if (refined === null) return null;
  return {
    ...map,
    section: {
      ...section,
      x: { ...section.x, values: refined.x },
      y: { ...section.y, values: refined.y },
      best: null,
    },
    distance: await decode(refined.value),
    error: null,
    status: null,
    rows: refined.y.length,
    columns: refined.x.length,
    xEdges: cellEdges(refined.x),
    yEdges: cellEdges(refined.y),
  };
}

/** Returns the cell of a map that lies nearest to a place, null in a map without cells. */
export function cellNear(map: MapData, place: { readonly x: number; readonly y: number }): Cell | null {
  const row = nearest(map.section.y.values, place.y);
  const column = nearest(map.section.x.values, place.x);
  return row < 0 || column < 0 ? null : { row, column };
}

/** Returns the place of a cell in the units of the axes. */
export function placeOf(map: MapData, { row, column }: Cell): { x: number; y: number } {
  return { x: at(map.section.x.values, column), y: at(map.section.y.values, row) };
}

export function distanceAt(map: MapData, row: number, column: number): number {
  return at(map.distance.data, row * map.columns + column);
}

export function errorAt(map: MapData, row: number, column: number): number {
  return map.error === null ? Number.NaN : at(map.error.data, row * map.columns + column);
}

/** Returns why a setting has no distance, null when it has one and nothing failed. */
export function failureAt(map: MapData, row: number, column: number): string | null {
  const status = map.status === null ? 0 : at(map.status.data, row * map.columns + column);
  if (status === 0 && Number.isFinite(distanceAt(map, row, column))) return null;
  return map.section.statuses.get(String(status)) ?? "not computed";
}

/** Returns how what is kept of a setting is found: in the page, at the server, or not at all. */
export function excerptSource(
  map: MapData,
  context: Context,
): ((row: number, column: number) => Promise<Excerpt | null>) | null {
  const { cells } = map.section;
  if (cells !== null) {
    const decoded = Promise.all([
      decodeMaybe(cells.excerpt_time),
      decodeMaybe(cells.excerpt_x),
      decodeMaybe(cells.excerpt_y),
      decodeMaybe(cells.density),
      decodeMaybe(cells.ks_step_length),
      decodeMaybe(cells.ks_turning_angle),
    ]);
    return async (row, column) => {
      const [time, x, y, density, length, angle] = await decoded;
      const cell = row * map.columns + column;
      return {
        x: x === null ? [] : part(x, row, column),
        y: y === null ? [] : part(y, row, column),
        time,
        density:
          density === null ? null : { shape: density.shape.slice(2), data: part(density, row, column) },
        ksStepLength: at(length?.data ?? [], cell),
        ksTurningAngle: at(angle?.data ?? [], cell),
      };
    };
  }
  const { fetchCell } = context;
  if (fetchCell === null) return null;
  return async (row, column) => decodeExcerpt(await fetchCell(map.section.id, row, column));
}

async function decodeExcerpt(cell: CellExcerpt): Promise<Excerpt | null> {
  if (cell.x === null && cell.density === null) return null;
  const [time, x, y, density] = await Promise.all([
    decodeMaybe(cell.time),
    decodeMaybe(cell.x),
    decodeMaybe(cell.y),
    decodeMaybe(cell.density),
  ]);
  return {
    x: x?.data ?? [],
    y: y?.data ?? [],
    time,
    density,
    ksStepLength: cell.ksStepLength ?? Number.NaN,
    ksTurningAngle: cell.ksTurningAngle ?? Number.NaN,
  };
}
