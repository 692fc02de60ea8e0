/** One tank of blocks in the browser: the twin of `LiveTank` (src/driftwalk/assembly/live_world.py), bit for bit. */

import { type Address, worldKey } from "./core";
import { type Model, putRules } from "./model";
import { className, graphClass } from "./shapes";

/** What the knobs of a tank stand at. */
export interface Values {
  drag_coefficient: number;
  force_std: number;
  blocks: number;
  flow_scale: number;
  latching: string;
  faces: string;
  hidden_face_drag: string;
  stirring_length: number;
  bond_rate: number;
  magnets: string;
}

/** Blocks of a world in the core's memory: `most_blocks` in cpp/include/driftwalk/assembly/rules.hpp. */
const MOST_BLOCKS = 2000;
/** Share of a time step within which an instant is that of the step's end. */
const ROUNDING = 1e-6;
/** Bits of a world that lost its numbers. */
const BROKEN = 3;

export interface State {
  readonly pose: Float64Array;
  readonly velocity: Float64Array;
  readonly assembly: Int32Array;
  readonly cell: Int32Array;
  readonly kind: Int32Array;
}

export class LocalTank {
  readonly timeStep: number;
  private readonly perInterval: number;
  private world: Address = 0;
  private values: Values;
  private wished: Values;
  private parting = false;
  private changed = false;
  private due = 0;

  constructor(
    readonly model: Model,
    values: Values,
    seed = model.local.seed,
    replicate = 0,
  ) {
    const numbers = model.local.numbers;
    this.timeStep = numbers.get("time_step") ?? Number.NaN;
    this.perInterval = numbers.get("steps_per_interval") ?? Number.NaN;
    this.values = this.wished = { ...values };
    this.restart(seed, replicate);
  }

  /** Begins again with what was wished last; false where the blocks find no place. */
  restart(seed: number, replicate = 0): boolean {
    const { core, run, trial, local } = this.model;
    const { call } = core;
    const key = worldKey(seed, trial, replicate);
    const { blocks } = this.wished;
    const rules = this.putRules(this.wished);
    const start = core.put(new Float64Array(3 * blocks));
    const placed = call.place(run, rules, blocks, key, start) === blocks;
    if (placed) {
      this.end();
      this.values = this.wished;
      this.world = call.make_world(run, rules, blocks, start, key, local.flow_start, this.faces());
      this.changed = this.parting = false;
      this.due = 0;
      this.setForces();
    }
    call.release(start);
    call.release(rules);
    return placed;
  }

  end(): void {
    if (this.world !== 0) this.model.core.call.end_world(this.world);
    this.world = 0;
  }

  /** Changes settings from the next force interval on. */
  set(changes: Partial<Values>, parting = false): void {
    this.wished = { ...this.wished, ...changes };
    this.parting ||= parting;
    this.changed = true;
  }

  get wishes(): Values {
    return this.wished;
  }

  get step(): number {
    return this.model.core.call.step_of(this.world);
  }

  /** Simulated time [s]. */
  get time(): number {
    return this.step * this.timeStep;
  }

  get blocks(): number {
    return this.model.core.call.blocks_of(this.world);
  }

  get waiting(): number {
    return Math.max(this.wished.blocks - this.blocks, 0);
  }

  get isBroken(): boolean {
    return (this.model.core.call.status_of(this.world) & BROKEN) !== 0;
  }

  /** Lets the world go on for a while [s]; what is left of a time step counts for the next one. */
  advance(duration: number): void {
    const due = this.due + duration;
    const steps = Math.floor(due / this.timeStep + ROUNDING);
    this.due = due - steps * this.timeStep;
    this.go(steps);
  }

  go(wanted: number): void {
    let steps = wanted;
    while (steps > 0) {
      const into = this.step % this.perInterval;
      if (into === 0) this.fulfil();
      const waits = this.changed || this.waiting > 0;
      const now = waits ? Math.min(steps, this.perInterval - into) : steps;
      // The core stops where events have filled their room.
      for (const end = this.step + now; this.step < end; ) {
        this.model.core.call.advance(this.world, end - this.step);
      }
      steps -= now;
    }
  }

  /** The blocks as they are now, until the next call. */
  read(): State {
    const { core } = this.model;
    const [at, blocks] = [core.call.read(this.world), this.blocks];
    const [doubles, ints] = [8 * MOST_BLOCKS, 4 * MOST_BLOCKS];
    const whole = at + 6 * doubles;
    return {
      pose: core.doubles(at, 3 * blocks),
      velocity: core.doubles(at + 3 * doubles, 3 * blocks),
      assembly: core.ints(whole, blocks),
      cell: core.ints(whole + ints, 2 * blocks),
      kind: core.ints(whole + 4 * ints, blocks),
    };
  }

  /** Outcome class of the world, as `assemble` names it. */
  outcome(state: State): string {
    const { shape, chirality, numbers, width, contact_gap: gap, most_named: most } = this.model.local;
    if (shape === "square") return className(state, chirality === "merged", most);
    const noun = shape === "disc" ? "discs" : "rectangles";
    return graphClass(state, { noun, side: numbers.get("side") ?? Number.NaN, width, gap }, most);
  }

  /** Poles of the blocks' faces; no rows where faces have no types. */
  poles(state: State): number[][] {
    const table = this.model.poles.get(this.values.faces) ?? [];
    if (table.length === 0) return [];
    return Array.from(state.kind, (kind) => table.slice(4 * kind, 4 * kind + 4));
  }

  private fulfil(): void {
    const { call } = this.model.core;
    if (this.changed) {
      const before = this.values;
      this.values = this.wished;
      this.changed = false;
      this.setForces();
      const rules = this.putRules(this.values);
      call.set_rules(this.world, rules);
      call.release(rules);
      if (this.values.faces !== before.faces) call.set_faces(this.world, this.faces());
      if (this.parting) call.part(this.world);
      this.parting = false;
    }
    if (this.values.blocks !== this.blocks) call.set_blocks(this.world, this.values.blocks);
  }

  private setForces(): void {
    const { call } = this.model.core;
    call.set_forces(this.world, this.values.drag_coefficient, this.values.force_std, this.values.flow_scale);
    call.set_pull(this.world, this.model.pulls.get(this.values.magnets) ?? 0);
  }

  private faces(): Address {
    return this.model.faces.get(this.values.faces) ?? 0;
  }

  private putRules(values: Values): Address {
    const { core, local } = this.model;
    const meaning = (knob: string, option: string): [string, number][] => {
      const found = local.choices.get(knob)?.get(option);
      return typeof found === "number" ? [[knob === "latching" ? knob : "hidden_share", found]] : [];
    };
    return putRules(
      core,
      new Map([
        ...local.rules,
        ...meaning("latching", values.latching),
        ...meaning("hidden_face_drag", values.hidden_face_drag),
        ["stirring_length", values.stirring_length],
        ["bond_rate", values.bond_rate],
      ]),
    );
  }
}
