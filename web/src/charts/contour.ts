/** The line where a field on a grid has one value. */

import { at } from "../arrays";
import type { Point } from "../tank/outline";

type Segment = readonly [Point, Point];

/** Returns pieces of the line at `level`; cells with a corner that is no number have none. */
export function contourLine(
  x: readonly number[],
  y: readonly number[],
  value: ArrayLike<number>,
  level: number,
): Segment[] {
  const segments: Segment[] = [];
  for (let row = 0; row + 1 < y.length; row += 1) {
    for (let column = 0; column + 1 < x.length; column += 1) {
      segments.push(...inCell(x, y, value, level, row, column));
    }
  }
  return segments;
}

/** Returns where the line crosses one cell: its crossings with the cell's border, in pairs. */
function inCell(
  x: readonly number[],
  y: readonly number[],
  value: ArrayLike<number>,
  level: number,
  row: number,
  column: number,
): Segment[] {
  const corner = (right: number, up: number): [Point, number] => [
    [at(x, column + right), at(y, row + up)],
    at(value, (row + up) * x.length + column + right),
  ];
  const around = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)] as const;
  const crossings: Point[] = [];
  around.forEach(([from, low], index) => {
    const [to, high] = around[(index + 1) % 4] ?? [from, low];
    if (low < level === high < level || !Number.isFinite(low + high)) return;
    const share = (level - low) / (high - low);
    crossings.push([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]);
  });
  const [a, b, c, d] = crossings;
  if (a === undefined || b === undefined) return [];
  if (c === undefined || d === undefined) return crossings.length === 2 ? [[a, b]] : [];
  // A saddle: the value in the middle says which corners belong together.
  const middle = around.reduce((sum, [, height]) => sum + height, 0) / 4;
  const lowFirst = around[0][1] < level;
  return lowFirst === middle < level
    ? [
        [a, b],
        [c, d],
      ]
    : [
        [a, d],
        [b, c],
      ];
}

/** Returns the data of a path of all pieces. */
export function contourPath(
  segments: readonly Segment[],
  px: (x: number) => number,
  py: (y: number) => number,
): string {
  return segments
    .map(
      ([[x0, y0], [x1, y1]]) =>
        `M${px(x0).toFixed(1)} ${py(y0).toFixed(1)}L${px(x1).toFixed(1)} ${py(y1).toFixed(1)}`,
    )
    .join("");
}
