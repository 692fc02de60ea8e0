/** Lines through many points: broken at gaps, thinned to what a pixel can show. */

import { at } from "../arrays";

/** Returns the data of a path through points [px]; a point that is no number breaks the line. */
export function linePath(x: ArrayLike<number>, y: ArrayLike<number>, from = 0, to = x.length): string {
  let path = "";
  let down = false;
  for (let index = from; index < to; index += 1) {
    const [px, py] = [at(x, index), at(y, index)];
    if (!Number.isFinite(px) || !Number.isFinite(py)) {
      down = false;
      continue;
    }
    path += `${down ? "L" : "M"}${px.toFixed(1)} ${py.toFixed(1)}`;
    down = true;
  }
  return path;
}

/** Returns the data of the area between two lines. */
export function bandPath(x: ArrayLike<number>, low: ArrayLike<number>, high: ArrayLike<number>): string {
  const known = Array.from(x, (_, index) => index).filter(
    (index) => Number.isFinite(at(low, index)) && Number.isFinite(at(high, index)),
  );
  if (known.length === 0) return "";
  const there = known.map((index) => `${at(x, index).toFixed(1)} ${at(high, index).toFixed(1)}`);
  const back = [...known].reverse().map((index) => `${at(x, index).toFixed(1)} ${at(low, index).toFixed(1)}`);
  return `M${[...there, ...back].join("L")}Z`;
}

/**
 * Keeps of each stretch the first, lowest, highest and last sample, so that a long series keeps its
 * look; a stretch with a gap keeps one sample that is no number.
 */
export function thinnedSeries(
  x: ArrayLike<number>,
  y: ArrayLike<number>,
  stretches: number,
): { x: number[]; y: number[] } {
  const kept: number[] = [];
  const size = Math.max(1, Math.ceil(x.length / stretches));
  for (let start = 0; start < x.length; start += size) {
    kept.push(...keptOf(y, start, Math.min(start + size, x.length)));
  }
  return { x: kept.map((index) => at(x, index)), y: kept.map((index) => at(y, index)) };
}

function keptOf(y: ArrayLike<number>, start: number, end: number): number[] {
  let [lowest, highest, gap] = [start, start, -1];
  for (let index = start; index < end; index += 1) {
    const value = at(y, index);
    if (!Number.isFinite(value)) gap = index;
    if (!(at(y, lowest) <= value)) lowest = Number.isFinite(value) ? index : lowest;
    if (!(at(y, highest) >= value)) highest = Number.isFinite(value) ? index : highest;
  }
  const chosen = new Set([start, lowest, highest, end - 1]);
  if (gap >= 0) chosen.add(gap);
  return [...chosen].sort((one, other) => one - other);
}
