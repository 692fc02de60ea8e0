/** Sketches of outcome classes: their shapes as small squares, or discs. */

import { svg } from "./dom";

/** Lower left corner of a square, y upwards, in sides of a block; with a third number, 1, that of a disc. */
export type Square = readonly [x: number, y: number, disc?: number];

/** Rows from top to bottom, as seen from above; larger shapes are named by theirs. */
export const SHAPES: Readonly<Record<string, string>> = {
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

/** Returns the cells of a shape from its name, its longer side lying; none when it is no shape. */
export function cellsOfShape(name: string): Square[] {
  const code = SHAPES[name] ?? name;
  if (!/^[x.]+(\/[x.]+)*$/.test(code) || !code.includes("x")) return [];
  const rows = code.split("/");
  const cells = rows.flatMap((row, index) =>
    [...row].flatMap((letter, column): Square[] =>
      letter === "x" ? [[column, rows.length - 1 - index]] : [],
    ),
  );
  const { width, height } = sizeOf(cells);
  return width >= height ? cells : cells.map(([x, y]): Square => [height - 1 - y, x]);
}

/** Returns the name of a class as it is written: empty for a code, which nobody can read. */
export function writtenName(name: string): string {
  return name.includes("x") ? "" : name;
}

/** Returns width and height of a sketch, in sides of a block. */
export function sizeOf(squares: readonly Square[]): { width: number; height: number } {
  if (squares.length === 0) return { width: 0, height: 0 };
  const reach = (axis: 0 | 1): number => 1 + Math.max(...squares.map((square) => square[axis]));
  return { width: reach(0), height: reach(1) };
}

/** Draws a sketch with its top left corner at (x, y); one square is `side` pixels wide. */
export function drawSketch(
  squares: readonly Square[],
  x: number,
  y: number,
  side: number,
  colour?: string,
): SVGGElement {
  const { height } = sizeOf(squares);
  const gap = Math.min(1, 0.12 * side);
  const group = svg("g", { class: "sketch" });
  if (colour !== undefined) group.style.setProperty("fill", colour);
  for (const [left, bottom, disc] of squares) {
    group.append(
      svg("rect", {
        x: x + left * side + gap / 2,
        y: y + (height - bottom - 1) * side + gap / 2,
        width: side - gap,
        height: side - gap,
        rx: disc === 1 ? (side - gap) / 2 : 0,
      }),
    );
  }
  return group;
}

/** Returns a sketch as a picture of its own. */
export function sketchPicture(squares: readonly Square[], side: number, colour?: string): SVGSVGElement {
  const size = sizeOf(squares);
  const [width, height] = [Math.max(1, size.width * side), Math.max(1, size.height * side)];
  const picture = svg("svg", { width, height, viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" });
  picture.append(drawSketch(squares, 0, 0, side, colour));
  return picture;
}
