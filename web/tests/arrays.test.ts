import assert from "node:assert/strict";
import test from "node:test";
import { deflateSync } from "node:zlib";
import { type Numbers, decode, extent, lastUpTo, nearest, numbers, part } from "../src/arrays";

function base64(bytes: Uint8Array): string {
  return btoa(String.fromCharCode(...bytes));
}

function packed(content: Uint8Array, more: object): Numbers {
  return numbers({ data: base64(deflateSync(content)), ...more }, "array");
}

/** Little-endian bytes of one, a half and "not a number", as an oracle that does not ask the machine. */
const [ONE, HALF, NONE] = [
  [0, 0, 0x80, 0x3f],
  [0, 0, 0, 0x3f],
  [0, 0, 0xc0, 0x7f],
] as const;

test("floats are inflated and read little-endian, not a number included", async () => {
  const grid = await decode(packed(Uint8Array.of(...ONE, ...NONE, ...HALF, ...ONE), { shape: [2, 2] }));
  assert.deepEqual(grid.shape, [2, 2]);
  assert.deepEqual([...grid.data], [1, Number.NaN, 0.5, 1]);
});

test("the offset is added in double precision", async () => {
  const grid = await decode(packed(Uint8Array.of(...HALF), { shape: [1], offset: 1_700_000_000 }));
  assert.deepEqual([...grid.data], [1_700_000_000.5]);
});

test("plain lists keep their shape, null is not a number", async () => {
  const grid = await decode(
    numbers(
      [
        [1, null, 3],
        [4, 5, 6],
      ],
      "array",
    ),
  );
  assert.deepEqual(grid.shape, [2, 3]);
  assert.deepEqual([...grid.data], [1, Number.NaN, 3, 4, 5, 6]);
  assert.deepEqual([...part(grid, 1)], [4, 5, 6]);
});

test("an array that is cut short or ragged is refused in words", async () => {
  await assert.rejects(decode(packed(Uint8Array.of(...ONE), { shape: [3] })), /shape 3 holds 4 bytes/);
  await assert.rejects(decode(numbers({ shape: [1], data: "AAAA" }, "array")));
  await assert.rejects(decode(numbers([[1, 2], [3]], "array")), /rows .* differ/);
  assert.throws(
    () => numbers({ shape: [], data: 1 }, "map.value"),
    /'map.value.data' is not text/,
  );
  assert.throws(() => numbers([1, "2"], "x"), /'x\[1\]' is not a number: got "2"/);
});

test("extent, nearest and lastUpTo agree with their words", () => {
  assert.deepEqual(extent([Number.NaN, 3, -1, Infinity]), [-1, 3]);
  assert.equal(extent([Number.NaN]), null);
  assert.equal(nearest([0, 1, 2], 1.4), 1);
  assert.equal(nearest([], 1), -1);
  const times = [0, 1, 1, 4];
  for (const [limit, expected] of [
    [-1, 0],
    [0, 0],
    [0.5, 0],
    [1, 2],
    [3.9, 2],
    [4, 3],
    [9, 3],
  ] as const) {
    assert.equal(lastUpTo(times, limit), expected, `up to ${limit}`);
  }
});
