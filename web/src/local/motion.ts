/** Steps of single blocks next to those of a recording: the twin of src/driftwalk/viewer/play/motion.py. */

import { type Address, type Core, doubles } from "./core";
import type { Local } from "./model";

type Recording = NonNullable<Local["motion"]["recording"]>;

/** Positions that are kept of all blocks together. */
const MOST = 20_000;
/** Fewer steps have no distance that means anything. */
const FEWEST = 30;
const PERMUTATIONS = 19;
/** Bins of an axis where there is no recording. */
const BINS = 32;

export interface Density {
  readonly type: "density";
  readonly simulated: number[][];
  readonly recording: number[][] | null;
  readonly step_length_edges: readonly number[];
  readonly turning_angle_edges: readonly number[];
  readonly ks_distance: number | null;
  readonly noise_floor: number | null;
  readonly steps: number;
}

/** Uniform random numbers, at least 0 and below 1 (mulberry32): for the camera's noise and for permutations. */
function randomOf(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let bits = Math.imul(state ^ (state >>> 15), state | 1);
    bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
    return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** Points in columns. */
interface Steps {
  readonly length: Float64Array;
  readonly angle: Float64Array;
}

export class MotionWindow {
  readonly interval: number;
  private readonly random: () => number;
  private reference: Address = 0;
  private points: Steps | null = null;
  private shares: number[][] | null = null;
  private columns: Float64Array[] = [];
  private count = 0;
  private room = 0;
  private floor: { steps: number; value: number | null } = { steps: 0, value: null };
  private permuting: { distances: number[]; one: () => number } | null = null;

  constructor(
    private readonly core: Core,
    private readonly motion: Local["motion"],
    seed: number,
  ) {
    this.interval = motion.interval;
    this.random = randomOf(seed);
  }

  /** Makes the recording ready. */
  async prepare(): Promise<void> {
    const { recording } = this.motion;
    if (recording === null) return;
    const pairs = await doubles(recording.points);
    const column = (axis: number): Float64Array =>
      Float64Array.from({ length: pairs.length / 2 }, (_, index) => pairs[2 * index + axis] ?? Number.NaN);
    this.points = { length: column(0), angle: column(1) };
    this.shares = density(this.points, recording.length_edge, recording.angle_edge);
    const { length, angle } = this.points;
    this.reference = this.core.with([length, angle], (x, y) =>
      this.core.call.make_reference(x, y, length.length),
    );
  }

  /** Forgets everything: the steps to come are of other settings. */
  clear(): void {
    this.columns = [];
    this.count = 0;
    this.floor = { steps: 0, value: null };
    this.permuting = null;
  }

  /** Takes the positions of all blocks at the next instant; blocks of equal labels are joined. */
  add(x: readonly number[], y: readonly number[], labels: ArrayLike<number>): void {
    const blocks = x.length;
    if (this.columns.length !== 2 * blocks) {
      this.clear();
      this.room = Math.max(Math.floor(MOST / Math.max(blocks, 1)), 100);
      this.columns = Array.from({ length: 2 * blocks }, () => new Float64Array(this.room));
    }
    if (this.count === this.room) {
      // The older half goes.
      const half = this.room >> 1;
      for (const column of this.columns) column.copyWithin(0, this.room - half);
      this.count = half;
    }
    const members = new Map<number, number>();
    for (let block = 0; block < blocks; block += 1) {
      const label = labels[block] ?? 0;
      members.set(label, (members.get(label) ?? 0) + 1);
    }
    for (let block = 0; block < blocks; block += 1) {
      const single = members.get(labels[block] ?? 0) === 1;
      for (const [axis, values] of [x, y].entries()) {
        const column = this.columns[2 * block + axis];
        if (column !== undefined) column[this.count] = single ? this.seen(values[block] ?? 0) : Number.NaN;
      }
    }
    this.count += 1;
  }

  /** Returns the density of the steps, the recording's density, and their distance. */
  message(): Density {
    const steps = this.steps();
    const { recording } = this.motion;
    const top = steps.length.reduce((most, one) => Math.max(most, one), 0) || 1;
    const lengths = recording?.length_edge ?? edges(0, top);
    const angles = recording?.angle_edge ?? edges(-Math.PI, Math.PI);
    const enough = recording !== null && steps.length.length >= FEWEST;
    return {
      type: "density",
      simulated: density(steps, lengths, angles),
      recording: this.shares,
      step_length_edges: lengths,
      turning_angle_edges: angles,
      ks_distance: enough
        ? this.core.with([steps.length, steps.angle], (x, y) =>
            this.core.call.ks_distance(this.reference, x, y, steps.length.length),
          )
        : null,
      noise_floor: enough ? this.noiseFloor(steps, recording) : null,
      steps: steps.length.length,
    };
  }

  /** Computes one more permutation of those that the noise floor needs, if any is missing. */
  work(): void {
    const { permuting } = this;
    if (permuting === null || permuting.distances.length >= PERMUTATIONS) return;
    permuting.distances.push(permuting.one());
    if (permuting.distances.length < PERMUTATIONS) return;
    this.floor.value = permuting.distances.sort((a, b) => a - b)[PERMUTATIONS >> 1] ?? null;
    this.permuting = null;
  }

  /** Returns step lengths [m] and turning angles [rad], one block after the other. */
  steps(): Steps {
    const blocks = this.columns.length / 2;
    const room = Math.max(this.count, 1);
    const [length, angle]: [number[], number[]] = [[], []];
    const memory = this.core.put(new Float64Array(4 * room));
    for (let block = 0; block < blocks; block += 1) {
      const at = (part: number): Address => memory + 8 * part * room;
      for (const axis of [0, 1]) {
        const column = this.columns[2 * block + axis]?.subarray(0, this.count) ?? [];
        this.core.doubles(at(axis), this.count).set(column);
      }
      const found = this.core.call.form_steps(at(0), at(1), this.count, at(2), at(3));
      length.push(...this.core.doubles(at(2), found));
      angle.push(...this.core.doubles(at(3), found));
    }
    this.core.call.release(memory);
    return { length: Float64Array.from(length), angle: Float64Array.from(angle) };
  }

  private seen(value: number): number {
    const { recording } = this.motion;
    if (recording === null) return value;
    const { noise, quantum } = recording;
    const spread = Math.sqrt(-2 * Math.log(1 - this.random())) * Math.cos(2 * Math.PI * this.random());
    const noisy = value + noise * spread;
    return quantum > 0 ? quantum * Math.round(noisy / quantum) : noisy;
  }

  /** Returns the noise floor; it is computed again when there are three tenths more steps. */
  private noiseFloor(steps: Steps, recording: Recording): number | null {
    if (steps.length.length > 1.3 * this.floor.steps && this.permuting === null) {
      this.floor.steps = steps.length.length;
      this.permuting = this.permutations(steps, recording.block_length);
    }
    return this.floor.value;
  }

  /** Returns distances of the two series when their blocks are shuffled; null where there are too few. */
  private permutations(steps: Steps, length: number): { distances: number[]; one: () => number } | null {
    const other = this.points;
    if (other === null) return null;
    const counts = [steps, other].map((one) => Math.floor(one.length.length / length)) as [number, number];
    if (Math.min(...counts) < 2) return null;
    const [first, second] = [counts[0] * length, counts[1] * length];
    const joined = (axis: keyof Steps): Float64Array =>
      Float64Array.from([...steps[axis].subarray(0, first), ...other[axis].subarray(0, second)]);
    const columns = [joined("length"), joined("angle")];
    const blockOf = Int32Array.from({ length: first + second }, (_, index) => Math.floor(index / length));
    const labels = Uint8Array.from({ length: counts[0] + counts[1] }, (_, index) => Number(index >= counts[0]));
    const one = (): number => {
      for (let last = labels.length - 1; last > 0; last -= 1) {
        const other = Math.floor(this.random() * (last + 1));
        [labels[last], labels[other]] = [labels[other] ?? 0, labels[last] ?? 0];
      }
      const [blocks, own] = [this.core.put(blockOf, "int"), this.core.put(labels, "byte")];
      const distance = this.core.with(columns, (x, y) =>
        this.core.call.permuted_distance(x, y, first, second, blocks, labels.length, own),
      );
      this.core.call.release(blocks);
      this.core.call.release(own);
      return distance;
    };
    return { distances: [], one };
  }
}

function edges(low: number, high: number): number[] {
  return Array.from({ length: BINS + 1 }, (_, index) => low + ((high - low) * index) / BINS);
}

/** Returns the share of steps in every bin, as `joint_density` in src/driftwalk/comparison/statistic.py. */
function density(steps: Steps, lengths: readonly number[], angles: readonly number[]): number[][] {
  const shares = lengths.slice(1).map(() => angles.slice(1).map(() => 0));
  const each = 1 / Math.max(steps.length.length, 1);
  steps.length.forEach((length, index) => {
    const row = shares[binOf(length, lengths)];
    const bin = binOf(steps.angle[index] ?? 0, angles);
    if (row !== undefined) row[bin] = (row[bin] ?? 0) + each;
  });
  return shares;
}

/** Returns the bin of a value in equal bins; what lies beyond counts in the last or the first. */
function binOf(value: number, bins: readonly number[]): number {
  const [low, high, count] = [bins[0] ?? 0, bins.at(-1) ?? 1, bins.length - 1];
  return Math.min(count - 1, Math.max(0, Math.floor((count * (value - low)) / (high - low))));
}
