import assert from "node:assert/strict";
import test from "node:test";
import { deflateSync } from "node:zlib";
import { type Numbers, decode, extent, lastUpTo, nearest, numbers, part } from "../src/arrays";

function base64(bytes: Uint8Array): string {
  return btoa(String.fromCharCode(...bytes));
}

function packed(content: Uint8Array, more: object): Numbers {
  return numbers({ data: base64(content), packed: "none", ...more }, "array");
}

/** Little-endian bytes, written byte by byte as an oracle that does not ask the machine. */
function int16(values: readonly number[]): Uint8Array {
  return Uint8Array.from(values.flatMap((value) => [value & 255, (value >> 8) & 255]));
}

test("bytes are numbers as they are", async () => {
  const grid = await decode(packed(Uint8Array.of(0, 1, 2, 255, 4, 5), { dtype: "u1", shape: [2, 3] }));
  assert.deepEqual(grid.shape, [2, 3]);
  assert.deepEqual([...grid.data], [0, 1, 2, 255, 4, 5]);
});

test("floats are read little-endian, not a number included", async () => {
  const one = Uint8Array.of(0, 0, 0x80, 0x3f);
  const none = Uint8Array.of(0, 0, 0xc0, 0x7f);
  const grid = await decode(packed(Uint8Array.of(...one, ...none), { dtype: "f4", shape: [2] }));
  assert.deepEqual([...grid.data], [1, Number.NaN]);
  const half = Uint8Array.of(0, 0, 0, 0, 0, 0, 0xe0, 0x3f);
  assert.deepEqual([...(await decode(packed(half, { dtype: "f8", shape: [1] }))).data], [0.5]);
});

test("integers are scaled, and the missing one is not a number", async () => {
  const source = packed(int16([10, -32768, -4]), {
    dtype: "i2",
    shape: [3],
    scale: 0.5,
    offset: 1,
    missing: -32768,
  });
  assert.deepEqual([...(await decode(source)).data], [6, Number.NaN, -1]);
});

test("differences add up along the last axis of each row, and wrap", async () => {
  const source = packed(int16([30000, 10000, 1, 5, -6, 1]), { dtype: "i2", shape: [2, 3], delta: true });
  assert.deepEqual([...(await decode(source)).data], [30000, 40000 - 65536, 40001 - 65536, 5, -1, 0]);
});

test("deflated bytes are inflated", async () => {
  const content = Uint8Array.from({ length: 5000 }, (_, index) => index % 7);
  const source = numbers(
    { dtype: "u1", shape: [5000], packed: "deflate", data: base64(deflateSync(content)) },
    "array",
  );
  assert.deepEqual([...(await decode(source)).data], [...content]);
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
  await assert.rejects(decode(packed(int16([1, 2]), { dtype: "i2", shape: [3] })), /shape 3 holds 2/);
  await assert.rejects(decode(packed(Uint8Array.of(1), { dtype: "i2", shape: [1] })), /1 bytes/);
  await assert.rejects(decode(numbers([[1, 2], [3]], "array")), /rows .* differ/);
  assert.throws(
    () => numbers({ dtype: "i8", shape: [], data: "" }, "map.value"),
    /'map.value.dtype' is not one of/,
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
