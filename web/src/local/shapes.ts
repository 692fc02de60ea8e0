/** Names of shapes and outcome classes, as src/driftwalk/assembly/outcomes/class_names.py gives them. */

import { SHAPES, type Square } from "../polyomino";
import { code, turns } from "../tank/joined";

interface Joined {
  readonly assembly: ArrayLike<number>;
  readonly cell: ArrayLike<number>;
}

const NAMES = Object.keys(SHAPES);
const known = new Map<string, string>();

function rowsOf(rowCode: string): number {
  return rowCode.split("/").length;
}

/** Returns the code of the fewest rows, and among those the one with cells the earliest, of all ways to turn cells. */
function canonical(cells: readonly Square[], merged: boolean): string {
  const codes = [...turns(cells), ...(merged ? turns(cells.map(([x, y]): Square => [-x, y])) : [])];
  const fewest = Math.min(...codes.map(rowsOf));
  return codes.filter((one) => rowsOf(one) === fewest).reduce((one, other) => (other > one ? other : one));
}

function cellsOf(rowCode: string): Square[] {
  const rows = rowCode.split("/");
  return rows.flatMap((row, index) =>
    [...row].flatMap((letter, x): Square[] => (letter === "x" ? [[x, rows.length - index]] : [])),
  );
}

/** Returns the name of a shape: a short one up to four cells, else its canonical code. */
export function shapeName(cells: readonly Square[], merged: boolean): string {
  const given = `${merged}${code(cells)}`;
  let name = known.get(given);
  if (name === undefined) {
    const own = canonical(cells, merged);
    name = NAMES.find((short) => canonical(cellsOf(SHAPES[short] ?? ""), merged) === own) ?? own;
    known.set(given, name);
  }
  return name;
}

/** Returns what shapes are sorted by, the larger ones first. */
function order(name: string): readonly (number | string)[] {
  const place = NAMES.indexOf(name);
  const cells = cellsOf(SHAPES[name] ?? name);
  if (place >= 0) return [-cells.length, place, "", ""];
  const sorted = (own: string): string => own.replace(/[x/.]/g, (sign) => String("x/.".indexOf(sign)));
  return [-cells.length, rowsOf(name) - 1, sorted(canonical(cells, true)), sorted(name)];
}

function before(one: string, other: string): number {
  const [first, second] = [order(one), order(other)];
  for (const [index, value] of first.entries()) {
    const against = second[index] ?? 0;
    if (value !== against) return value < against ? -1 : 1;
  }
  return 0;
}

function members(state: Joined): number[][] {
  const found = new Map<number, number[]>();
  for (let block = 0; block < state.assembly.length; block += 1) {
    const label = state.assembly[block] ?? 0;
    const group = found.get(label);
    if (group === undefined) found.set(label, [block]);
    else group.push(block);
  }
  return [...found.values()];
}

/** Returns the outcome class of a world; of more than `most` blocks how many assemblies there are. */
export function className(state: Joined, merged: boolean, most: number): string {
  const groups = members(state);
  if (state.assembly.length > most) return groups.length === 1 ? "1 assembly" : `${groups.length} assemblies`;
  const names = groups.map((group) =>
    shapeName(
      group.map((block): Square => [state.cell[2 * block] ?? 0, state.cell[2 * block + 1] ?? 0]),
      merged,
    ),
  );
  return names.sort(before).join("+");
}

/** Returns the sizes of the assemblies of discs or rectangles. */
export function sizesName(state: Joined): string {
  const sizes = members(state).map((group) => group.length);
  return sizes.sort((one, other) => other - one).join("+");
}

/** Returns how many assemblies of each shape there are; of many blocks, of each size. */
export function shapeCounts(state: Joined, outcome: string, most: number): Map<string, number> {
  const many = state.assembly.length > most;
  const names = many
    ? members(state).map(({ length }) => (length <= 2 ? String(length) : `${length} blocks`))
    : outcome.split("+");
  const counts = new Map<string, number>();
  for (const name of names) counts.set(name, (counts.get(name) ?? 0) + 1);
  return counts;
}
