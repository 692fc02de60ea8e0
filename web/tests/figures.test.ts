import assert from "node:assert/strict";
import test from "node:test";
import { contourLine } from "../src/charts/contour";
import { filledRange, marginal } from "../src/charts/density";
import { twoLines } from "../src/charts/frame";
import { linePath, thinnedSeries } from "../src/charts/paths";
import { boxAround, outline } from "../src/tank/outline";
import type { Arena } from "../src/page";

const EMPTY = { diameter_m: null, width_m: null, height_m: null, vertices_m: null, center_m: null };

test("the contour of a distance is a circle", () => {
  const axis = Array.from({ length: 41 }, (_, index) => -2 + index / 10);
  const value = axis.flatMap((y) => axis.map((x) => Math.hypot(x, y)));
  const segments = contourLine(axis, axis, value, 1.25);
  assert.ok(segments.length > 60);
  for (const [x, y] of segments.flat()) assert.ok(Math.abs(Math.hypot(x, y) - 1.25) < 2e-3);
  const length = segments.reduce((sum, [[x0, y0], [x1, y1]]) => sum + Math.hypot(x1 - x0, y1 - y0), 0);
  assert.ok(Math.abs(length - 2 * Math.PI * 1.25) < 0.01, `length ${length}`);
});

test("a contour has no pieces beside holes, and none where the level is not reached", () => {
  assert.deepEqual(contourLine([0, 1], [0, 1], [0, 1, Number.NaN, 1], 0.5), []);
  assert.deepEqual(contourLine([0, 1], [0, 1], [0, 1, 0, 1], 2), []);
  assert.equal(contourLine([0, 1], [0, 1], [1, 0, 0, 1], 0.4).length, 2, "a saddle has two pieces");
});

test("marginals add up, and a range holds all but the tails", () => {
  const share = { shape: [2, 3], data: Float64Array.from([0.1, 0.2, 0, 0.3, Number.NaN, 0.4]) };
  assert.deepEqual(
    marginal(share, 0).map((sum) => Number(sum.toFixed(9))),
    [0.3, 0.7],
  );
  assert.deepEqual(
    marginal(share, 1).map((sum) => Number(sum.toFixed(9))),
    [0.4, 0.2, 0.4],
  );
  const edges = [0, 1, 2, 3, 4, 5];
  assert.deepEqual(filledRange([0, 0.5, 0.5, 0, 0], edges), [1, 3]);
  assert.deepEqual(filledRange([0.0001, 0.5, 0.4998, 0, 0.0001], edges), [1, 3]);
  assert.deepEqual(filledRange([0, 0, 0, 0, 0], edges), [0, 5]);
});

test("a thinned series keeps its extremes and its gaps", () => {
  const x = Array.from({ length: 1000 }, (_, index) => index);
  const y = x.map((index) =>
    index === 437 ? 50 : index === 438 ? -50 : index === 700 ? Number.NaN : Math.sin(index),
  );
  const thin = thinnedSeries(x, y, 20);
  assert.ok(thin.x.length <= 20 * 5);
  assert.ok(thin.y.includes(50) && thin.y.includes(-50) && thin.y.some(Number.isNaN));
  assert.equal(thin.x[0], 0);
  assert.equal(thin.x.at(-1), 999);
  assert.ok(thin.x.every((value, index) => index === 0 || value > (thin.x[index - 1] ?? 0)));
});

test("a path is broken where there is no number", () => {
  assert.equal(linePath([0, 1, 2, 3], [0, Number.NaN, 2, 3]), "M0.0 0.0M2.0 2.0L3.0 3.0");
});

test("outlines of tanks have their size and place", () => {
  const circle: Arena = { ...EMPTY, shape: "circle", diameter_m: 0.3, center_m: [0.1, -0.2] };
  for (const [x, y] of outline(circle)) assert.ok(Math.abs(Math.hypot(x - 0.1, y + 0.2) - 0.15) < 1e-12);
  const rectangle: Arena = { ...EMPTY, shape: "rectangle", width_m: 2, height_m: 1 };
  assert.deepEqual(outline(rectangle), [
    [-1, -0.5],
    [1, -0.5],
    [1, 0.5],
    [-1, 0.5],
  ]);
  assert.deepEqual(boxAround(rectangle, [], [], 0.5), { x: [-2, 2], y: [-1.5, 1.5] });
  assert.deepEqual(boxAround(null, [0, 1], [0, 1], 0), { x: [0, 1], y: [0, 1] });
  assert.deepEqual(outline(null), []);
});

test("a label that is too long is broken where it can be read", () => {
  assert.deepEqual(twoLines("short", 100), ["short"]);
  assert.deepEqual(twoLines("force (mN), redrawn every 16 ms", 100), [
    "force (mN),",
    "redrawn every 16 ms",
  ]);
  assert.deepEqual(twoLines("component 2 (11 % of the variance)", 100), [
    "component 2",
    "(11 % of the variance)",
  ]);
});
