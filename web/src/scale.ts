/** Scales from values to pixels, and round ticks on them. */

export interface Scale {
  readonly domain: readonly [number, number];
  readonly log: boolean;
  /** Pixel of a value. */
  px(value: number): number;
  /** Value at a pixel. */
  value(px: number): number;
}

export function linearScale(domain: readonly [number, number], from: number, to: number): Scale {
  const [low, high] = domain;
  const span = high === low ? 1 : high - low;
  return {
    domain,
    log: false,
    px: (value) => from + ((value - low) / span) * (to - from),
    value: (px) => low + ((px - from) / (to - from)) * span,
  };
}

export function logScale(domain: readonly [number, number], from: number, to: number): Scale {
  const inner = linearScale([Math.log10(domain[0]), Math.log10(domain[1])], from, to);
  return {
    domain,
    log: true,
    px: (value) => inner.px(Math.log10(value)),
    value: (px) => 10 ** inner.value(px),
  };
}

/** Returns a step of 1, 2, 2.5 or 5 times a power of ten that gives at most `count` + 1 ticks. */
export function niceStep(span: number, count: number): number {
  const rough = span / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(rough));
  const factor = [1, 2, 2.5, 5, 10].find((candidate) => candidate * power >= rough * (1 - 1e-9)) ?? 10;
  return factor * power;
}

/** Returns round values inside of a range, about `count` of them. */
export function linearTicks(low: number, high: number, count: number): number[] {
  if (!(high > low)) return Number.isFinite(low) ? [low] : [];
  return multiples(low, high, niceStep(high - low, count));
}

/** Returns the multiples of a step inside of a range. */
export function multiples(low: number, high: number, step: number): number[] {
  const first = Math.ceil(low / step - 1e-6);
  const last = Math.floor(high / step + 1e-6);
  const ticks: number[] = [];
  for (let index = first; index <= last; index += 1) {
    ticks.push(Number((index * step).toPrecision(12)) + 0);
  }
  return ticks;
}

/** Returns powers of ten inside of a range, with 2 and 5 between them when there are few. */
export function logTicks(low: number, high: number, count: number): number[] {
  if (!(low > 0) || !(high > low)) return [];
  const decades = Math.log10(high / low);
  if (decades < 1) {
    const even = linearTicks(low, high, count).filter((tick) => tick > 0);
    // Even steps crowd at the upper end of the axis: two of them leave the lower half without any.
    if (even.length > 2) return even;
  }
  const factors = decades * 3 <= count + 2 ? [1, 2, 5] : [1];
  const every = Math.max(1, Math.ceil(decades / count));
  const ticks: number[] = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power += every) {
    for (const factor of factors) {
      const tick = Number((factor * 10 ** power).toPrecision(12));
      if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push(tick);
    }
  }
  return ticks;
}

/** Returns a range that starts and ends at round values and holds all of [low, high]. */
export function niceDomain(low: number, high: number, count = 5): [number, number] {
  if (!(high > low)) {
    const reach = Math.abs(low) > 0 ? Math.abs(low) / 2 : 1;
    return [low - reach, low + reach];
  }
  const step = niceStep(high - low, count);
  return [Math.floor(low / step + 1e-9) * step, Math.ceil(high / step - 1e-9) * step];
}

/** Returns the edges of the cells around grid points: midpoints, as far out again at the ends. */
export function cellEdges(centres: ArrayLike<number>): number[] {
  const points = Array.from(centres);
  const [first, second] = points;
  if (first === undefined) return [];
  if (second === undefined) {
    const half = Math.abs(first) > 0 ? Math.abs(first) / 2 : 0.5;
    return [first - half, first + half];
  }
  const inner = points.slice(1).map((point, index) => (point + (points[index] ?? point)) / 2);
  const last = points.at(-1) ?? first;
  return [2 * first - (inner[0] ?? first), ...inner, 2 * last - (inner.at(-1) ?? last)];
}

/** Returns the index of the cell that holds a value, -1 outside; edges ascend or descend. */
export function cellAt(edges: readonly number[], value: number): number {
  for (let index = 0; index + 1 < edges.length; index += 1) {
    const [one, other] = [edges[index] ?? 0, edges[index + 1] ?? 0];
    if (value >= Math.min(one, other) && value < Math.max(one, other)) return index;
  }
  const last = edges.at(-1);
  return last !== undefined && value === last ? edges.length - 2 : -1;
}
