/** What a saved playground holds of its tank (src/driftwalk/viewer/play/saved.py), made ready for the core. */

import { type Checked, anything, list, nullable, number, object, oneOf, record, text } from "../check";
import { type Address, type Core, doubles } from "./core";

const motion = object({
  interval: number,
  recording: nullable(
    object({
      points: text,
      length_edge: list(number),
      angle_edge: list(number),
      noise: number,
      quantum: number,
      block_length: number,
    }),
  ),
});

export const checkLocal = object({
  wasm: text,
  numbers: record(number),
  arrays: record(text),
  nodes: list(number),
  flow_repeat: number,
  flow_start: number,
  seed: number,
  trial: text,
  rules: record(number),
  choices: record(record(anything)),
  chirality: text,
  shape: oneOf("square", "disc", "rectangle"),
  width: nullable(number),
  contact_gap: number,
  most_named: number,
  run_steps: number,
  motion,
});
export type Local = Checked<typeof checkLocal>;

const faceTable = object({
  latches: list(number),
  type: list(number),
  pole: list(number),
  number: list(number),
  becomes: list(number),
});

const pullTables = object({
  reach: number,
  lever: number,
  every: number,
  near_fading: number,
  near_end: number,
  near_reach: number,
  radial: list(object({ what: text, cells: text, first: number })),
  oriented: nullable(
    object({
      coefficient: text,
      angles: number,
      first: number,
      per_step: number,
      low: number,
      high: number,
    }),
  ),
  multipoles: nullable(
    object({ coefficient: list(number), softening: number, fading: number, end: number }),
  ),
});

const ARRAYS = ["u", "v", "frame_time", "edges", "panels", "corners", "moment_points"];
const FORCES = ["centres", "resistance", "faces"];
/** The order of `Rules` in cpp/wasm/playground.cpp. */
const RULES = [
  "latching",
  "connector_distance",
  "connector_cosine",
  "hidden_share",
  "stirring_length",
  "incompressible",
  "block_restitution",
  "block_friction",
  "bond_rate",
  "bond_force",
  "bond_strength",
  "relatch_clearance",
];

export type Rules = ReadonlyMap<string, number>;

/** A model in the core, and what the options of choices mean there. */
export interface Model {
  readonly core: Core;
  readonly local: Local;
  readonly run: Address;
  /** Tables of typed faces by option; 0 for none. */
  readonly faces: ReadonlyMap<string, Address>;
  /** Poles of a kind's faces by option, four a kind. */
  readonly poles: ReadonlyMap<string, readonly number[]>;
  /** Tables of forces between blocks by option; 0 for none. */
  readonly pulls: ReadonlyMap<string, Address>;
  readonly trial: bigint;
}

export function putRules(core: Core, rules: Rules): Address {
  return core.put(RULES.map((name) => rules.get(name) ?? Number.NaN));
}

export async function makeModel(core: Core, local: Local): Promise<Model> {
  const names = core.words(core.call.number_names()).split(",").slice(0, -1);
  const numbers = core.put(names.map((name) => local.numbers.get(name) ?? Number.NaN));
  // Arrays stay: the model points to what it was given.
  const layout: number[] = [];
  for (const name of ARRAYS) {
    const values = await doubles(local.arrays.get(name) ?? "eJwDAAAAAAE=");
    layout.push(core.put(values), values.length);
  }
  const arrays = core.put([...layout, ...local.nodes, local.flow_repeat], "int");
  const [faces, poles] = [new Map<string, Address>(), new Map<string, readonly number[]>()];
  for (const [option, content] of local.choices.get("faces") ?? []) {
    faces.set(option, content === null ? 0 : makeFaces(core, content));
    poles.set(option, content === null ? [] : faceTable(content, option).pole);
  }
  const pulls = new Map<string, Address>();
  for (const [option, content] of local.choices.get("magnets") ?? []) {
    pulls.set(option, content === null ? 0 : await makePull(core, content));
  }
  const run = core.call.make_run(numbers, arrays);
  return { core, local, run, faces, poles, pulls, trial: BigInt(local.trial) };
}

function makeFaces(core: Core, content: unknown): Address {
  const table = faceTable(content, "faces");
  const put = (values: readonly number[]): Address => core.put(values, "int");
  return core.call.make_faces(
    table.number.length,
    Math.round(Math.sqrt(table.latches.length)),
    put(table.number),
    put(table.type),
    put(table.pole),
    put(table.latches),
    put(table.becomes),
  );
}

async function makePull(core: Core, content: unknown): Promise<Address> {
  const tables = pullTables(content, "magnets");
  const { reach, lever, every, near_fading, near_end, near_reach } = tables;
  const pull = core.call.make_pull(reach, lever, 0, every, near_fading, near_end, near_reach);
  for (const { what, cells, first } of tables.radial) {
    const values = await doubles(cells);
    core.with([values], (at) =>
      core.call.set_radial(pull, FORCES.indexOf(what), at, values.length / 2, first),
    );
  }
  if (tables.oriented !== null) {
    const { coefficient, angles, first, per_step, low, high } = tables.oriented;
    const values = await doubles(coefficient);
    core.with([values], (at) =>
      core.call.set_oriented(pull, at, values.length / angles ** 2, angles, first, per_step, low, high),
    );
  }
  if (tables.multipoles !== null) {
    const { coefficient, softening, fading, end } = tables.multipoles;
    core.with([Float64Array.from(coefficient)], (at) =>
      core.call.set_multipoles(pull, at, softening, fading, end),
    );
  }
  return pull;
}
