import assert from "node:assert/strict";
import test from "node:test";
import {
  cellAt,
  cellEdges,
  linearScale,
  linearTicks,
  logScale,
  logTicks,
  niceDomain,
  niceStep,
} from "../src/scale";

function near(actual: number, expected: number, message = ""): void {
  assert.ok(
    Math.abs(actual - expected) <= 1e-9 * Math.max(1, Math.abs(expected)),
    `${message} ${actual} is not ${expected}`,
  );
}

test("a scale takes its ends to its ends, and back", () => {
  for (const make of [linearScale, logScale]) {
    const scale = make([0.2, 50], 30, 430);
    near(scale.px(0.2), 30);
    near(scale.px(50), 430);
    for (const value of [0.3, 1, 7, 49]) near(scale.value(scale.px(value)), value);
  }
  near(logScale([1, 100], 0, 10).px(10), 5, "the middle of two decades");
});

test("ticks are round, inside, equally far apart, and no more than asked for", () => {
  for (const [low, high] of [
    [0, 1],
    [-0.155, 0.155],
    [3.2e-4, 9.7e-4],
    [17, 17.3],
    [-5000, 120],
  ] as const) {
    for (const count of [3, 5, 9]) {
      const ticks = linearTicks(low, high, count);
      assert.ok(ticks.length >= 1 && ticks.length <= count + 1, `${ticks.length} ticks for ${count}`);
      assert.ok(ticks.every((tick) => tick >= low - 1e-9 && tick <= high + 1e-9));
      const step = niceStep(high - low, count);
      ticks.slice(1).forEach((tick, index) => near(tick - (ticks[index] ?? 0), step));
      const mantissa = step / 10 ** Math.floor(Math.log10(step) + 1e-9);
      assert.ok(
        [1, 2, 2.5, 5, 10].some((round) => Math.abs(mantissa - round) < 1e-6),
        `${step} is not round`,
      );
    }
  }
  assert.deepEqual(linearTicks(0, 1, 5), [0, 0.2, 0.4, 0.6, 0.8, 1]);
  assert.deepEqual(linearTicks(2, 2, 5), [2]);
});

test("ticks of a logarithmic axis are powers of ten, with 2 and 5 when there is room", () => {
  assert.deepEqual(logTicks(0.01, 100, 5), [0.01, 0.1, 1, 10, 100]);
  assert.deepEqual(logTicks(1, 100, 8), [1, 2, 5, 10, 20, 50, 100]);
  assert.deepEqual(logTicks(-1, 100, 8), []);
});

test("an axis of less than a decade has ticks in its lower half, too", () => {
  assert.deepEqual(logTicks(0.045, 0.26, 3), [0.05, 0.1, 0.2]);
  assert.deepEqual(logTicks(0.2, 0.9, 4), [0.2, 0.4, 0.6, 0.8]);
});

test("a nice domain holds its values", () => {
  const [low, high] = niceDomain(0.13, 0.97);
  assert.ok(low <= 0.13 && high >= 0.97);
  assert.deepEqual(niceDomain(3, 3), [1.5, 4.5]);
});

test("cells lie around their points, and are found again", () => {
  assert.deepEqual(cellEdges([1, 2, 4]), [0.5, 1.5, 3, 5]);
  assert.deepEqual(cellEdges([2]), [1, 3]);
  const edges = cellEdges([1, 2, 4]);
  for (const [value, cell] of [
    [0.5, 0],
    [1.4, 0],
    [1.6, 1],
    [4, 2],
    [5, 2],
    [5.1, -1],
    [0.4, -1],
  ] as const) {
    assert.equal(cellAt(edges, value), cell, `cell of ${value}`);
  }
  assert.equal(cellAt([3, 2, 1], 1.5), 1, "edges may descend");
});
