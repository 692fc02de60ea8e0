import assert from "node:assert/strict";
import test from "node:test";
import { ClassColours, colourScale, css, isComplete, rgb } from "../src/colours";
import { moveCell, moveSample } from "../src/keyboard";
import { pieces, shortName, spoken } from "../src/symbols";

test("symbols with an index are found, names with underscores are not", () => {
  assert.deepEqual(pieces("drag C_d and σ_F²"), [
    { text: "drag ", index: null },
    { text: "C", index: "d" },
    { text: " and ", index: null },
    { text: "σ", index: "F" },
    { text: "²", index: null },
  ]);
  for (const plain of ["drag_coefficient", "ks_map.png", "a_bc", "_d", "<b>x</b>"]) {
    assert.deepEqual(pieces(plain), [{ text: plain, index: null }]);
  }
  assert.equal(
    pieces("a C_d b")
      .map((piece) => piece.text)
      .join(""),
    "a C b",
  );
  assert.equal(spoken("sigma_F"), "σ F");
  assert.equal(shortName("stochastic force σ_F, redrawn"), "σ_F");
  assert.equal(shortName("time, in a tank"), "time");
});

test("a colour scale goes from its first colour to its last", () => {
  const scale = colourScale("score", 0, 1);
  assert.equal(css(scale.at(0)), "rgb(68,1,84)");
  assert.equal(css(scale.at(1)), "rgb(253,231,37)");
  assert.equal(scale.of(Number.NaN), null);
  assert.deepEqual(scale.of(7), scale.at(1));
  // The middle of viridis, as matplotlib has it.
  assert.deepEqual(scale.of(0.5), rgb("#21918c"));
  assert.equal(colourScale("density", 0, 4, { power: 0.5 }).position(1), 0.5);
});

test("classes of one assembly have hues, those of several greys", () => {
  const colours = new ClassColours();
  assert.deepEqual(
    ["I", "2+2", "T"].map((name) => colours.of(name)),
    ["#0072B2", "#9a9a9a", "#D55E00"],
  );
  assert.deepEqual(
    ["T", "O", "I"].map((name) => colours.of(name)),
    ["#D55E00", "#009E73", "#0072B2"],
    "once given, it stays",
  );
  assert.ok(isComplete("T") && !isComplete("2+2") && !isComplete("other"));
});

test("keys move over the map and stay on it", () => {
  const size = { rows: 3, columns: 4 };
  assert.deepEqual(moveCell({ row: 1, column: 1 }, "ArrowUp", size), { row: 2, column: 1 });
  assert.deepEqual(moveCell({ row: 2, column: 1 }, "ArrowUp", size), { row: 2, column: 1 });
  assert.deepEqual(moveCell({ row: 0, column: 0 }, "ArrowLeft", size), { row: 0, column: 0 });
  assert.deepEqual(moveCell({ row: 1, column: 1 }, "End", size), { row: 1, column: 3 });
  assert.equal(moveCell({ row: 1, column: 1 }, "a", size), null);
});

test("keys move in time and stay in it", () => {
  assert.equal(moveSample(5, "ArrowRight", 100), 6);
  assert.equal(moveSample(99, "ArrowRight", 100), 99);
  assert.equal(moveSample(5, "PageDown", 100), 3);
  assert.equal(moveSample(5, "Home", 100), 0);
  assert.equal(moveSample(5, "End", 100), 99);
  assert.equal(moveSample(5, "Enter", 100), null);
});
