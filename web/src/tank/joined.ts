/** Which blocks are joined, and the shapes that they make. */

import { type Square, cellsOfShape } from "../polyomino";

/** A block, its face, another block, its face; face 0 is a block's +x side, 1 +y, 2 -x, 3 -y. */
export type Join = readonly [block: string, face: number, other: string, otherFace: number];

const STEPS: readonly Square[] = [
  [1, 0],
  [0, 1],
  [-1, 0],
  [0, -1],
];
const NAMES = ["1", "2", "I3", "L3", "I", "O", "T", "S", "Z", "L", "J"] as const;

/** Returns the assemblies: lists of blocks that are joined, those of one block included. */
export function assemblies(blocks: readonly string[], joins: readonly Join[]): string[][] {
  const group = new Map(blocks.map((block) => [block, [block]]));
  for (const [one, , other] of joins) {
    const [mine, theirs] = [group.get(one), group.get(other)];
    if (mine === undefined || theirs === undefined || mine === theirs) continue;
    mine.push(...theirs);
    for (const block of theirs) group.set(block, mine);
  }
  return [...new Set(group.values())];
}

/** Returns the name of the shape of joined blocks: of a known one its name, else its cells as rows. */
export function shapeName(blocks: readonly string[], joins: readonly Join[]): string {
  const cells = latticeCells(blocks, joins);
  if (cells.length !== blocks.length) return `${blocks.length} blocks`;
  const turned = turns(cells);
  const mirrored = turns(cells.map(([x, y]): Square => [-x, y]));
  // As it is first: S and Z differ, where mirror images are distinct.
  for (const looks of [turned, mirrored]) {
    const found = NAMES.find((name) => looks.includes(code(cellsOfShape(name))));
    if (found !== undefined) return found;
  }
  return [...turned, ...mirrored].sort()[0] ?? "";
}

/** Returns the lattice cells of joined blocks, one after the other from the first. */
function latticeCells(blocks: readonly string[], joins: readonly Join[]): Square[] {
  const first = blocks[0];
  if (first === undefined) return [];
  const known = new Map<string, { cell: Square; quarter: number }>([[first, { cell: [0, 0], quarter: 0 }]]);
  const inside = new Set(blocks);
  const both = joins
    .filter(([one, , other]) => inside.has(one) && inside.has(other))
    .flatMap(([one, face, other, otherFace]): Join[] => [
      [one, face, other, otherFace],
      [other, otherFace, one, face],
    ]);
  for (let found = true; found;) {
    found = false;
    for (const [one, face, other, otherFace] of both) {
      const from = known.get(one);
      if (from === undefined || known.has(other)) continue;
      const direction = (face + from.quarter) % 4;
      const [dx, dy] = STEPS[direction] ?? [0, 0];
      // The other's face looks back.
      known.set(other, {
        cell: [from.cell[0] + dx, from.cell[1] + dy],
        quarter: (direction + 2 - otherFace + 8) % 4,
      });
      found = true;
    }
  }
  return [...known.values()].map((place) => place.cell);
}

/** Returns the codes of a shape in its four orientations. */
export function turns(cells: readonly Square[]): string[] {
  const looks: string[] = [];
  let now = cells;
  for (let quarter = 0; quarter < 4; quarter += 1) {
    looks.push(code(now));
    now = now.map(([x, y]): Square => [-y, x]);
  }
  return looks;
}

/** Returns rows from top to bottom, x for a cell, joined by "/". */
export function code(cells: readonly Square[]): string {
  const [xs, ys] = [cells.map((cell) => cell[0]), cells.map((cell) => cell[1])];
  const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const filled = new Set(cells.map(([x, y]) => `${x},${y}`));
  const rows: string[] = [];
  for (let y = high; y >= low; y -= 1) {
    let row = "";
    for (let x = left; x <= right; x += 1) row += filled.has(`${x},${y}`) ? "x" : ".";
    rows.push(row);
  }
  return rows.join("/");
}
