import assert from "node:assert/strict";
import test from "node:test";
import { Trails } from "../src/tank/trails";

const at = (id: string, x: number | null) => ({ id, x_m: x, y_m: 0 });

test("a trail goes back so far and no further", () => {
  const trails = new Trails(2);
  for (const time of [0, 1, 2, 3]) trails.add(time, [at("a", time)]);
  assert.deepEqual(trails.all(), [{ id: "a", x: [1, 2, 3], y: [0, 0, 0] }]);
  trails.add(3.5, [at("a", null)]);
  assert.deepEqual(trails.all()[0]?.x, [2, 3, Number.NaN]);
});

test("the trail of a body that has gone fades, and is forgotten", () => {
  const trails = new Trails(2);
  trails.add(0, [at("a", 0), at("b", 0)]);
  trails.add(1.5, [at("a", 1)]);
  assert.deepEqual(trails.all().map((one) => one.id), ["a", "b"]);
  trails.add(2.5, [at("a", 2)]);
  assert.deepEqual(trails.all().map((one) => one.id), ["a"]);
});

test("time that goes back begins anew", () => {
  const trails = new Trails(2);
  trails.add(100, [at("a", 5)]);
  trails.add(0, [at("a", 1)]);
  trails.add(0.5, [at("a", 2)]);
  assert.deepEqual(trails.all(), [{ id: "a", x: [1, 2], y: [0, 0] }]);
});
