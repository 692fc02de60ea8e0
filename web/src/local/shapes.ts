/** Names of shapes and outcome classes, as src/driftwalk/assembly/outcomes gives them. */

import { SHAPES, type Square } from "../polyomino";
import { code, turns } from "../tank/joined";

interface Joined {
  readonly assembly: ArrayLike<number>;
  readonly cell: ArrayLike<number>;
}

/** Discs or rectangles, whose shapes are contact graphs. */
export interface Bodies {
  readonly noun: "discs" | "rectangles";
  readonly side: number;
  readonly width: number | null;
  /** Gap up to which two of an assembly are a contact, in diameters or longer sides. */
  readonly gap: number;
}

type Order = readonly (number | string)[];
type Contact = readonly [one: number, other: number];

const NAMES = Object.keys(SHAPES);
const known = new Map<string, string>();
/** As in src/driftwalk/schema/shapes.py. */
const GRAPHS = new Map([
  ["ab.ac.bc", "triangle"],
  ["ab.ac.ad.bc", "paw"],
  ["ab.ac.ad.bc.bd", "diamond"],
]);
const MOST_IN_GRAPH = 8;
const graphOrder = new Map<string, Order>();

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

/** Returns all ways to list bodies group by group. */
function listings(groups: readonly (readonly number[])[]): number[][] {
  const [group, ...rest] = groups;
  if (group === undefined) return [[]];
  if (group.length === 0) return listings(rest);
  return group.flatMap((one) =>
    listings([group.filter((other) => other !== one), ...rest]).map((listed) => [one, ...listed]),
  );
}

/** Returns the first of the codes of a graph, of all numberings that have bodies with more contacts first. */
function graphCode(near: readonly (readonly number[])[], contacts: readonly Contact[]): string {
  let ranks = near.map((others) => near.length - others.length);
  for (let round = 0; round < near.length; round += 1) {
    const before = ranks;
    const seen = near.map((others, one) =>
      [before[one], ...others.map((other) => before[other]).sort()].join(""),
    );
    const sorted = [...seen].sort();
    ranks = seen.map((surroundings) => sorted.indexOf(surroundings));
  }
  const alike = near.map((_, rank) => [...ranks.keys()].filter((one) => ranks[one] === rank));
  const codes = listings(alike).map((listed) =>
    contacts
      .map((pair) =>
        pair
          .map((one) => "abcdefgh".charAt(listed.indexOf(one)))
          .sort()
          .join(""),
      )
      .sort()
      .join("."),
  );
  return codes.reduce((one, other) => (other < one ? other : one));
}

function newGraphName(bodies: number, contacts: readonly Contact[], noun: string): string {
  const near = Array.from({ length: bodies }, (_, one) =>
    contacts.filter((pair) => pair.includes(one)).map(([a, b]) => (a === one ? b : a)),
  );
  const degrees = near.map((others) => others.length);
  const isTree = contacts.length === bodies - 1;
  if (isTree && Math.max(...degrees) === 2) return `chain${bodies}`;
  if (isTree && Math.max(...degrees) === bodies - 1) return `star${bodies}`;
  if (bodies > 3 && degrees.every((degree) => degree === 2)) return `ring${bodies}`;
  if (bodies > MOST_IN_GRAPH) return `${bodies} ${noun}, ${contacts.length} contacts`;
  const code = graphCode(near, contacts);
  return GRAPHS.get(code) ?? code;
}

/** Returns the name of a contact graph, the same however its bodies are numbered. */
function graphName(bodies: number, contacts: readonly Contact[], noun: string): string {
  if (bodies <= 2) return String(bodies);
  const given = `${bodies} ${noun} ${contacts.join(" ")}`;
  let name = known.get(given);
  if (name === undefined) {
    name = newGraphName(bodies, contacts, noun);
    known.set(given, name);
    graphOrder.set(name, [-bodies, contacts.length, name.includes(".") ? "code" : "", name]);
  }
  return name;
}

/** Whether two bodies of an assembly touch: discs by their centres, rectangles by their separating axes. */
function touch(pose: ArrayLike<number>, one: number, other: number, bodies: Bodies): boolean {
  const at = (axis: number): number => (pose[3 * other + axis] ?? 0) - (pose[3 * one + axis] ?? 0);
  const [dx, dy, turn] = [at(0), at(1), at(2)];
  const { side, gap } = bodies;
  if (bodies.width === null) return Math.hypot(dx, dy) <= side * (1 + gap);
  const { width } = bodies;
  const [same, turned] = [Math.abs(Math.cos(turn)), Math.abs(Math.sin(turn))];
  const angles = [pose[3 * one + 2] ?? 0, pose[3 * other + 2] ?? 0];
  const along = Math.max(...angles.map((angle) => Math.abs(Math.cos(angle) * dx + Math.sin(angle) * dy)));
  const across = Math.max(...angles.map((angle) => Math.abs(Math.cos(angle) * dy - Math.sin(angle) * dx)));
  const depth = Math.min(
    (side * (1 + same) + width * turned) / 2 - along,
    (width * (1 + same) + side * turned) / 2 - across,
  );
  return depth >= -gap * Math.max(side, width);
}

/** Returns what shapes are sorted by, the larger ones first. */
function order(name: string): Order {
  const graph = graphOrder.get(name);
  if (graph !== undefined) return graph;
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

function members(state: Pick<Joined, "assembly">): number[][] {
  const found = new Map<number, number[]>();
  for (let block = 0; block < state.assembly.length; block += 1) {
    const label = state.assembly[block] ?? 0;
    const group = found.get(label);
    if (group === undefined) found.set(label, [block]);
    else group.push(block);
  }
  return [...found.values()];
}

/** Returns the class of a world; of more than `most` blocks how many assemblies there are. */
function classOf(state: Pick<Joined, "assembly">, most: number, nameOf: (group: readonly number[]) => string): string {
  const groups = members(state);
  if (state.assembly.length > most) return groups.length === 1 ? "1 assembly" : `${groups.length} assemblies`;
  return groups.map(nameOf).sort(before).join("+");
}

/** Returns the outcome class of a world of squares. */
export function className(state: Joined, merged: boolean, most: number): string {
  return classOf(state, most, (group) =>
    shapeName(
      group.map((block): Square => [state.cell[2 * block] ?? 0, state.cell[2 * block + 1] ?? 0]),
      merged,
    ),
  );
}

/** Returns the outcome class of a world of discs or rectangles. */
export function graphClass(
  state: Pick<Joined, "assembly"> & { readonly pose: ArrayLike<number> },
  bodies: Bodies,
  most: number,
): string {
  return classOf(state, most, (group) => {
    const contacts = group.flatMap((one, index) =>
      group.flatMap((other, next): Contact[] =>
        next > index && touch(state.pose, one, other, bodies) ? [[index, next]] : [],
      ),
    );
    return graphName(group.length, contacts, bodies.noun);
  });
}

/** Returns the sizes of the assemblies. */
export function sizesName(state: Pick<Joined, "assembly">): string {
  const sizes = members(state).map((group) => group.length);
  return sizes.sort((one, other) => other - one).join("+");
}

/** Returns how many assemblies of each shape there are; of many blocks, of each size. */
export function shapeCounts(state: Pick<Joined, "assembly">, outcome: string, most: number): Map<string, number> {
  const many = state.assembly.length > most;
  const names = many
    ? members(state).map(({ length }) => (length <= 2 ? String(length) : `${length} blocks`))
    : outcome.split("+");
  const counts = new Map<string, number>();
  for (const name of names) counts.set(name, (counts.get(name) ?? 0) + 1);
  return counts;
}
