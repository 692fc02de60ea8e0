/** Arrays as a page carries them: packed base64, or plain lists with null for "not a number". */

import {
  type Check,
  PageError,
  number,
  object,
  nullable,
  oneOf,
  list,
  flag,
  text,
  withDefault,
  plainObject,
} from "./check";

const packedShape = object({
  dtype: oneOf("f4", "f8", "i2", "i4", "u1"),
  shape: list(number),
  data: text,
  packed: withDefault(oneOf("none", "deflate"), "none"),
  scale: nullable(number),
  offset: nullable(number),
  missing: nullable(number),
  delta: withDefault(flag, false),
});

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

async function fromPacked(source: Packed): Promise<Grid> {
  let bytes = fromBase64(source.data);
  if (source.packed === "deflate") bytes = await inflate(bytes);
  const raw = typed(source.dtype, bytes);
  const size = sizeOf(source.shape);
  if (raw.length !== size) {
    throw new PageError(`an array of shape ${source.shape.join(" × ")} holds ${raw.length} numbers`);
  }
  if (source.delta) undoDifferences(raw, source.shape.at(-1) ?? 0);
  return { shape: source.shape, data: toValues(raw, source) };
}

function sizeOf(shape: readonly number[]): number {
  return shape.reduce((product, length) => product * length, 1);
}

function fromBase64(data: string): Uint8Array<ArrayBuffer> {
  const letters = atob(data);
  const bytes = new Uint8Array(letters.length);
  for (let index = 0; index < letters.length; index += 1) bytes[index] = letters.charCodeAt(index);
  return bytes;
}

async function inflate(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

type Raw = Float32Array | Float64Array | Int16Array | Int32Array | Uint8Array;

/** Reads little-endian numbers; every browser's machine is little-endian. */
function typed(dtype: Packed["dtype"], bytes: Uint8Array<ArrayBuffer>): Raw {
  const width = { f4: 4, f8: 8, i2: 2, i4: 4, u1: 1 }[dtype];
  if (bytes.length % width !== 0) throw new PageError(`an array of ${dtype} has ${bytes.length} bytes`);
  switch (dtype) {
    case "f4":
      return new Float32Array(bytes.buffer);
    case "f8":
      return new Float64Array(bytes.buffer);
    case "i2":
      return new Int16Array(bytes.buffer);
    case "i4":
      return new Int32Array(bytes.buffer);
    case "u1":
      return bytes;
  }
}

/** Adds up first differences along the last axis; the sum wraps as the stored numbers do. */
function undoDifferences(raw: Raw, length: number): void {
  for (let start = 0; length > 0 && start < raw.length; start += length) {
    for (let index = start + 1; index < start + length; index += 1) {
      raw[index] = at(raw, index) + at(raw, index - 1);
    }
  }
}

function toValues(raw: Raw, source: Packed): Float64Array {
  if (raw instanceof Float32Array || raw instanceof Float64Array) return Float64Array.from(raw);
  const scale = source.scale ?? 1;
  const offset = source.offset ?? 0;
  return Float64Array.from(raw, (value) => (value === source.missing ? Number.NaN : offset + scale * value));
}
