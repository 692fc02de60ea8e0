/** Arrays as a page carries them: deflated float32 in base64, or plain lists with null for "not a number". */

import { type Check, PageError, list, number, object, plainObject, text, withDefault } from "./check";

const packedShape = object({ shape: list(number), offset: withDefault(number, 0), data: text });

type Packed = ReturnType<typeof packedShape>;
type Nested = readonly (number | null | Nested)[];

/** An array of a page that has not been decoded yet. */
export type Numbers = Packed | Nested;

/** Numbers in C order; not a number where there is none. */
export interface Grid {
  readonly shape: readonly number[];
  readonly data: Float64Array;
}

export const numbers: Check<Numbers> = (value, where) => {
  if (Array.isArray(value)) {
    checkNested(value, where);
    return value as Nested;
  }
  plainObject(value, where);
  return packedShape(value, where);
};

/** Returns the numbers of an array of a page. */
export async function decode(source: Numbers): Promise<Grid> {
  return isNested(source) ? fromNested(source) : fromPacked(source);
}

/** Returns the numbers of an array that may be absent. */
export async function decodeMaybe(source: Numbers | null): Promise<Grid | null> {
  return source === null ? null : decode(source);
}

/** Returns one number of a sequence, not a number outside of it. */
export function at(values: ArrayLike<number>, index: number): number {
  return values[index] ?? Number.NaN;
}

/** Returns the part of a grid at one index of its first axes, without copying. */
export function part(grid: Grid, ...index: number[]): Float64Array {
  const size = grid.shape.slice(index.length).reduce((product, length) => product * length, 1);
  let start = 0;
  index.forEach((place, axis) => {
    start = start * at(grid.shape, axis) + place;
  });
  return grid.data.subarray(start * size, (start + 1) * size);
}

/** Returns the smallest and the largest finite value, null when there is none. */
export function extent(values: Iterable<number>): [number, number] | null {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : null;
}

/** Returns the index of the value that is nearest, -1 when there is none. */
export function nearest(values: ArrayLike<number>, wanted: number): number {
  let best = -1;
  for (let index = 0; index < values.length; index += 1) {
    const gap = Math.abs(at(values, index) - wanted);
    if (gap < (best < 0 ? Infinity : Math.abs(at(values, best) - wanted))) best = index;
  }
  return best;
}

/** Returns the index of the last value that is not above, 0 when all are; values ascend. */
export function lastUpTo(values: ArrayLike<number>, limit: number): number {
  let low = 0;
  let high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (at(values, middle) <= limit) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}

function isNested(source: Numbers): source is Nested {
  return Array.isArray(source);
}

function checkNested(value: readonly unknown[], where: string): void {
  value.forEach((item, index) => {
    if (Array.isArray(item)) checkNested(item, `${where}[${index}]`);
    else if (item !== null) number(item, `${where}[${index}]`);
  });
}

function fromNested(source: Nested): Grid {
  const shape: number[] = [];
  for (let level: unknown = source; Array.isArray(level); level = level[0]) shape.push(level.length);
  const flat = (source as unknown[]).flat(Infinity) as (number | null)[];
  const data = Float64Array.from(flat, (value) => value ?? Number.NaN);
  if (data.length !== sizeOf(shape)) throw new PageError("the rows of an array differ in length");
  return { shape, data };
}

/** Reads little-endian numbers; every browser's machine is little-endian. */
async function fromPacked({ shape, offset, data }: Packed): Promise<Grid> {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const content = await new Response(stream).arrayBuffer();
  if (content.byteLength !== 4 * sizeOf(shape)) {
    throw new PageError(`an array of shape ${shape.join(" × ")} holds ${content.byteLength} bytes`);
  }
  return { shape, data: Float64Array.from(new Float32Array(content), (value) => offset + value) };
}

function sizeOf(shape: readonly number[]): number {
  return shape.reduce((product, length) => product * length, 1);
}
