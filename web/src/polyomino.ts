/** Sketches of outcome classes: the shapes of a class as small squares. */

import { svg } from "./dom";
import type { Polyominoes } from "./page";

export type Square = readonly [x: number, y: number];

export interface Sketch {
  /** Lower left corners of the squares, y upwards, in sides of a block. */
  readonly squares: Square[];
  readonly width: number;
  readonly height: number;
}

/** Rows from top to bottom, as seen from above; larger shapes are named by theirs. */
const SHAPES: Readonly<Record<string, string>> = {
  "1": "x",
  "2": "xx",
  I3: "xxx",
  L3: "x./xx",
  I: "xxxx",
  O: "xx/xx",
  T: "xxx/.x.",
  S: ".xx/xx.",
  Z: "xx./.xx",
  L: "x./x./xx",
  J: ".x/.x/xx",
};

/** Empty space between the shapes of a class, in sides of a block. */
const GAP = 0.6;

/** Returns the cells of every shape of a class from its name; none when it names no shapes. */
export function cellsOfName(name: string): Polyominoes {
  const shapes = name.split("+").map((shape) => SHAPES[shape] ?? shape);
  if (!shapes.every((shape) => /^[x.]+(\/[x.]+)*$/.test(shape) && shape.includes("x"))) return [];
  return shapes.map((shape) => {
    const rows = shape.split("/");
    return rows.flatMap((row, index) =>
      [...row].flatMap((letter, column): [number, number][] =>
        letter === "x" ? [[column, rows.length - 1 - index]] : [],
      ),
    );
  });
}

/** Returns the name of a class as it is written: empty for a code, which nobody can read. */
export function writtenName(name: string): string {
  return name.includes("x") ? "" : name;
}

/** Returns the shapes packed into a compact picture, each lying on its longer side. */
export function sketchOf(cells: Polyominoes): Sketch {
  const shapes = cells.filter((shape) => shape.length > 0).map(lying);
  if (shapes.length === 0) return { squares: [], width: 0, height: 0 };
  const sizes = shapes.map((shape): Square => [1 + most(shape, 0), 1 + most(shape, 1)]);
  const placed = packed(sizes);
  const [width, height] = [reach(placed, sizes, 0), reach(placed, sizes, 1)];
  const squares = shapes.flatMap((shape, index) => {
    const [left, top] = placed[index] ?? [0, 0];
    const tall = sizes[index]?.[1] ?? 1;
    return shape.map(([x, y]): Square => [x + left, y + height - top - tall]);
  });
  return { squares, width, height };
}

/** Draws a sketch with its top left corner at (x, y); one square is `side` pixels wide. */
export function drawSketch(sketch: Sketch, x: number, y: number, side: number, colour?: string): SVGGElement {
  const gap = Math.min(1, 0.12 * side);
  const group = svg("g", { class: "sketch" });
  if (colour !== undefined) group.style.setProperty("fill", colour);
  for (const [left, bottom] of sketch.squares) {
    group.append(
      svg("rect", {
        x: x + left * side + gap / 2,
        y: y + (sketch.height - bottom - 1) * side + gap / 2,
        width: side - gap,
        height: side - gap,
      }),
    );
  }
  return group;
}

/** Returns a sketch as a picture of its own. */
export function sketchPicture(cells: Polyominoes, side: number, colour?: string): SVGSVGElement {
  const sketch = sketchOf(cells);
  const [width, height] = [Math.max(1, sketch.width * side), Math.max(1, sketch.height * side)];
  const picture = svg("svg", { width, height, viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" });
  picture.append(drawSketch(sketch, 0, 0, side, colour));
  return picture;
}

function most(shape: readonly Square[], axis: 0 | 1): number {
  return Math.max(...shape.map((cell) => cell[axis]));
}

/** Moves a shape to (0, 0) and turns it so that its longer side lies. */
function lying(shape: readonly Square[]): Square[] {
  const [left, bottom] = [Math.min(...shape.map((c) => c[0])), Math.min(...shape.map((c) => c[1]))];
  const moved = shape.map(([x, y]): Square => [x - left, y - bottom]);
  if (most(moved, 0) >= most(moved, 1)) return moved;
  const tall = most(moved, 1);
  return moved.map(([x, y]): Square => [tall - y, x]);
}

function reach(placed: readonly Square[], sizes: readonly Square[], axis: 0 | 1): number {
  return Math.max(...placed.map((corner, index) => corner[axis] + (sizes[index]?.[axis] ?? 0)));
}

/**
 * Returns left and top of every box, packed on shelves. Every sensible width of the shelves is
 * tried; the picture with the smallest longer side is taken, then the smallest area, then the
 * flattest.
 */
function packed(sizes: readonly Square[]): Square[] {
  const widths = sizes.map((size) => size[0]);
  const widest = Math.max(...widths);
  const limits = new Set<number>();
  for (let first = 0; first < widths.length; first += 1) {
    let sum = -GAP;
    for (const width of widths.slice(first)) {
      sum += width + GAP;
      if (sum >= widest - 1e-9) limits.add(sum);
    }
  }
  const tried = [...limits].sort((one, other) => one - other).map((limit) => shelves(sizes, limit));
  const badness = (placed: Square[]): number[] => {
    const [width, height] = [reach(placed, sizes, 0), reach(placed, sizes, 1)];
    return [Math.max(width, height), width * height, height];
  };
  return tried.reduce((best, next) => (isLess(badness(next), badness(best)) ? next : best));
}

function isLess(one: readonly number[], other: readonly number[]): boolean {
  for (const [index, value] of one.entries()) {
    const gap = value - (other[index] ?? 0);
    if (Math.abs(gap) > 1e-9) return gap < 0;
  }
  return false;
}

/** Puts boxes one after the other on shelves no wider than `limit`. */
function shelves(sizes: readonly Square[], limit: number): Square[] {
  let [left, top, deepest] = [0, 0, 0];
  return sizes.map(([width, height]): Square => {
    if (left > 0 && left + width > limit + 1e-9) [left, top, deepest] = [0, top + deepest + GAP, 0];
    const corner: Square = [left, top];
    left += width + GAP;
    deepest = Math.max(deepest, height);
    return corner;
  });
}
