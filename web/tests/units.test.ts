import assert from "node:assert/strict";
import test from "node:test";
import {
  displayOf,
  duration,
  labelled,
  percent,
  prettyUnit,
  quantity,
  short,
  stepDecimals,
  valueAndInterval,
  whole,
} from "../src/units";

test("values stand in the unit that a reader expects", () => {
  const expected: [number, string, string][] = [
    [0.155, "m", "15.5 cm"],
    [0.0065, "m", "6.5 mm"],
    [0.00029597, "m", "0.296 mm"],
    [2.5, "m", "2.5 m"],
    [0.00055, "N", "0.55 mN"],
    [0.016, "s", "16 ms"],
    [1800, "s", "1800 s"],
    [Math.PI / 6, "rad", "30°"],
    [0.0659, "m/s", "6.59 cm/s"],
    [0.0659, "m s-1", "6.59 cm/s"],
    [0.4, "1", "0.4"],
    [10, "Hz", "10 Hz"],
    [0, "N", "0 N"],
  ];
  for (const [value, unit, text] of expected) assert.equal(quantity(value, unit), text);
});

test("numbers have a real minus, no useless zeros, and powers of ten when they are far from one", () => {
  assert.equal(short(-0.5), "−0.5");
  assert.equal(short(1234.5), "1235");
  assert.equal(short(0.1 + 0.2), "0.3");
  assert.equal(short(7.0756e-9), "7.08×10⁻⁹");
  assert.equal(short(Number.NaN), "–");
  assert.equal(whole(17999), "17\u202f999");
  assert.equal(whole(1681), "1681");
  assert.equal(percent(0.8975), "89.8 %");
  assert.equal(prettyUnit("N2 s"), "N² s");
  assert.equal(prettyUnit("m s-1"), "m s⁻¹");
});

test("an interval decides how many decimals a value has", () => {
  assert.deepEqual(valueAndInterval(0.3825, 0.37471, 0.39879, "1"), {
    value: "0.383",
    interval: "0.375 to 0.399",
    unit: "",
  });
  assert.deepEqual(valueAndInterval(0.000665, 0.00053448, 0.00071217, "N"), {
    value: "0.67",
    interval: "0.53 to 0.71",
    unit: "mN",
  });
  assert.deepEqual(valueAndInterval(17999, null, null, "1"), {
    value: "17\u202f999",
    interval: null,
    unit: "",
  });
});

test("the unit of a label stands before what a comma adds", () => {
  const display = displayOf("N", 0.001);
  assert.equal(
    labelled("force σ_F, redrawn every 16 ms", display),
    "force σ_F (mN), redrawn every 16 ms",
  );
  assert.equal(labelled("drag", displayOf("1", 1)), "drag");
});

test("steps are written in full", () => {
  for (const [step, decimals] of [
    [1, 0],
    [0.5, 1],
    [0.25, 2],
    [0.1, 1],
    [0.025, 3],
    [20, 0],
  ] as const) {
    assert.equal(stepDecimals(step), decimals, `step ${step}`);
  }
});

test("durations are read as people say them", () => {
  for (const [seconds, text] of [
    [3.21, "3.21 s"],
    [119, "119 s"],
    [125, "2 min 5 s"],
    [3600, "60 min"],
    [7500, "2 h 5 min"],
  ] as const) {
    assert.equal(duration(seconds), text);
  }
});
