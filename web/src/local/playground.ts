/** The playground's worker: a tank that goes on picture by picture, or runs whose outcomes are counted. */

import { Core, inflated } from "./core";
import { type Local, type Model, checkLocal, makeModel } from "./model";
import { MotionWindow } from "./motion";
import { shapeCounts, sizesName } from "./shapes";
import { LocalTank, type Values } from "./tank";

/** What the page asks of a worker, first of all how to begin. */
export type Request =
  | { type: "begin"; local: unknown; values: Values; speed: number; seed: number }
  | { type: "count"; local: unknown; values: Values; seed: number; runs: number }
  | { type: "set"; name: string; value: unknown }
  | { type: "action"; name: string }
  | { type: "ready" };
type Publish = (message: Readonly<Record<string, unknown>>) => void;

/** Time that a picture may take [ms]: of the 16.7 ms of 60 pictures a second, what drawing leaves. */
const PICTURE_MS = 12;
/** Time after which the tank has waited for the page, and does not catch up [ms]. */
const LONGEST_PAUSE_MS = 100;
const DENSITY_MS = 500;
const COUNT_MS = 100;
/** Blocks up to which shapes tell outcomes apart, as `MOST_BLOCKS` in outcome_classes.py; of more by sizes. */
const MOST_LISTED = 8;
/** Share of a time step within which an instant is that of the step's end. */
const ROUNDING = 1e-6;

export async function modelOf(local: Local): Promise<Model> {
  return makeModel(await Core.of(await inflated(local.wasm)), local);
}

class Moving {
  private readonly motion: MotionWindow;
  private paused = false;
  private last = performance.now();
  private compared = 0;
  private nextSample = 0;
  private left = 0;
  private pace: { wall: number; time: number }[] = [];

  constructor(
    private readonly tank: LocalTank,
    private speed: number,
    private seed: number,
    private readonly publish: Publish,
  ) {
    const { core, local } = tank.model;
    this.motion = new MotionWindow(core, local.motion, seed);
  }

  async begin(): Promise<void> {
    await this.motion.prepare();
    this.show();
  }

  receive(request: Request): void {
    if (request.type === "ready") setTimeout(() => this.picture(), this.paused ? LONGEST_PAUSE_MS : 0);
    else if (request.type === "set") this.set(request.name, request.value);
    else if (request.type === "action") this.act(request.name);
  }

  private set(name: string, value: unknown): void {
    if (name === "speed") {
      this.speed = Number(value);
      return;
    }
    // Without latching nothing would hold together: whoever turns it off wants to see that.
    this.tank.set({ [name]: value }, name === "latching" && value === "none");
    this.motion.clear();
  }

  private act(name: string): void {
    if (name === "pause" || name === "run") this.paused = name === "pause";
    else this.motion.clear();
    if (name !== "restart") return;
    this.seed += 1;
    if (!this.tank.restart(this.seed)) this.say("The blocks find no room: take fewer.");
    this.nextSample = this.left = 0;
    this.paused = false;
  }

  private say(words: string): void {
    this.publish({ type: "note", words });
  }

  private picture(): void {
    const now = performance.now();
    const wall = Math.min(now - this.last, LONGEST_PAUSE_MS) / 1000;
    this.last = now;
    if (!this.paused) this.advance(wall * this.speed, now + PICTURE_MS);
    this.motion.work();
    if (now - this.compared > DENSITY_MS) {
      this.compared = now;
      this.publish({ ...this.motion.message() });
    }
    this.show();
  }

  /** Goes on by whole time steps, and takes the blocks' positions on the way. */
  private advance(duration: number, until: number): void {
    const { tank } = this;
    const step = tank.timeStep;
    this.left += duration;
    while (this.left >= step && performance.now() < until) {
      const at = this.nextSample / step;
      const ahead = Math.floor(at + ROUNDING) - tank.step;
      const share = Math.max(at - Math.floor(at + ROUNDING), 0);
      const steps = Math.min(ahead, Math.floor(this.left / step + ROUNDING));
      if (steps > 0) this.go(steps);
      else if (share < ROUNDING) this.take(this.places());
      else {
        // The camera looks within the next step.
        const before = this.places();
        this.go(1);
        const after = this.places();
        const same = before.x.length === after.x.length;
        const between = (old: readonly number[], now: readonly number[]): number[] =>
          now.map((value, index) => (same ? (1 - share) * (old[index] ?? 0) + share * value : value));
        this.take({ x: between(before.x, after.x), y: between(before.y, after.y) });
      }
    }
    // What could not be done in time is not caught up with.
    this.left %= step;
    if (!tank.isBroken) return;
    this.paused = true;
    this.say("The blocks' positions were lost: weaken the forces or the flow, and restart.");
  }

  private go(steps: number): void {
    this.tank.go(steps);
    this.left -= steps * this.tank.timeStep;
  }

  private places(): { x: number[]; y: number[] } {
    const { pose } = this.tank.read();
    const column = (axis: number): number[] =>
      Array.from({ length: pose.length / 3 }, (_, block) => pose[3 * block + axis] ?? Number.NaN);
    return { x: column(0), y: column(1) };
  }

  private take({ x, y }: { x: number[]; y: number[] }): void {
    this.motion.add(x, y, this.tank.read().assembly);
    this.nextSample += this.motion.interval;
  }

  private show(): void {
    const { tank } = this;
    const { shape, most_named: most } = tank.model.local;
    const state = tank.read();
    const outcome = tank.outcome(state);
    this.publish({
      type: "tank",
      time_s: tank.time,
      speed: this.paceNow(),
      paused: this.paused,
      ...this.places(),
      theta: Array.from(tank.read().assembly, (_, block) =>
        shape === "disc" ? null : (state.pose[3 * block + 2] ?? null),
      ),
      assembly: Array.from(state.assembly),
      poles: tank.poles(state),
      waiting: tank.waiting,
      outcome,
      counts: Object.fromEntries(shapeCounts(state, outcome, most)),
      seed: this.seed,
    });
  }

  /** Returns the speed of the last second, simulated over real time; null where unknown. */
  private paceNow(): number | null {
    this.pace.push({ wall: performance.now() / 1000, time: this.tank.time });
    const latest = this.pace.at(-1) ?? { wall: 0, time: 0 };
    this.pace = this.pace.filter((one) => latest.wall - one.wall <= 1 && one.time <= latest.time);
    const first = this.pace[0] ?? latest;
    const elapsed = latest.wall - first.wall;
    return elapsed > 0 ? (latest.time - first.time) / elapsed : null;
  }
}

export interface Outcome {
  readonly name: string;
  /** When all blocks were one assembly [s], to a second; null where they never were. */
  readonly complete: number | null;
}

/** Returns the class at the end of a run: when all blocks are one assembly, or after the study's duration. */
export function outcomeOf(model: Model, values: Values, seed: number, replicate: number): Outcome {
  const tank = new LocalTank(model, values, seed, replicate);
  const { run_steps: end, rules } = model.local;
  const forever = values.bond_rate > 0 || (rules.get("bond_strength") ?? 0) > 0;
  const every = Math.ceil(1 / tank.timeStep);
  let complete: number | null = null;
  while (tank.step < end && (forever || complete === null)) {
    tank.go(Math.min(every, end - tank.step));
    const isWhole = values.blocks > 1 && tank.read().assembly.every((label) => label === 0);
    if (isWhole) complete ??= tank.time;
  }
  const state = tank.read();
  const name = values.blocks > MOST_LISTED ? `sizes ${sizesName(state)}` : tank.outcome(state);
  tank.end();
  return { name, complete };
}

function count(model: Model, request: Request & { type: "count" }, publish: Publish): void {
  const counts = new Map<string, number>();
  const times: number[] = [];
  let told = 0;
  for (let done = 1; done <= request.runs; done += 1) {
    const { name, complete } = outcomeOf(model, request.values, request.seed, done - 1);
    counts.set(name, (counts.get(name) ?? 0) + 1);
    if (complete !== null) times.push(complete);
    if (done < request.runs && performance.now() - told < COUNT_MS) continue;
    told = performance.now();
    times.sort((one, other) => one - other);
    const half = times[Math.ceil(done / 2) - 1] ?? null;
    const counted = { counts: Object.fromEntries(counts), done, runs: request.runs };
    publish({ type: "counts", ...counted, complete: times.length / done, median_s: half });
  }
}

/** Serves a page: the first request says what is to be done. */
function serve(): void {
  const publish: Publish = (message) => postMessage(message);
  let moving: Moving | null = null;
  const begin = async (request: Request & { type: "begin" | "count" }): Promise<void> => {
    const model = await modelOf(checkLocal(request.local, ""));
    if (request.type === "count") return count(model, request, publish);
    const { values, seed, speed } = request;
    moving = new Moving(new LocalTank(model, values, seed), speed, seed, publish);
    await moving.begin();
  };
  addEventListener("message", (event: MessageEvent<Request>) => {
    const request = event.data;
    if (request.type === "begin" || request.type === "count") {
      begin(request).catch((error: unknown) => {
        publish({ type: "note", words: `The tank cannot run here: ${String(error)}` });
      });
    } else moving?.receive(request);
  });
}

if (typeof document === "undefined" && typeof addEventListener === "function") serve();

export { LocalTank, MotionWindow, checkLocal, shapeCounts };
export { className, graphClass, shapeName } from "./shapes";
