import assert from "node:assert/strict";
import test from "node:test";
import { type Square, cellsOfShape, sizeOf, writtenName } from "../src/polyomino";
import { type Join, assemblies, code, shapeName } from "../src/tank/joined";

test("names and codes give cells, the longer side lying, other words none", () => {
  assert.deepEqual(cellsOfShape("2"), [
    [0, 0],
    [1, 0],
  ]);
  assert.deepEqual(cellsOfShape("x./xx"), [
    [0, 1],
    [0, 0],
    [1, 0],
  ]);
  // Turned, not mirrored.
  assert.deepEqual(cellsOfShape("L"), [
    [0, 0],
    [1, 0],
    [2, 0],
    [2, 1],
  ]);
  for (const none of ["other", "", "...", "Q", "2+1"]) assert.deepEqual(cellsOfShape(none), []);
  assert.equal(writtenName("L3+1"), "L3+1");
  assert.equal(writtenName("xxx/x.x"), "");
});

test("a sketch is as large as its squares reach", () => {
  const squares: Square[] = [
    [0, 1.6],
    [1, 1.6],
    [0, 0],
  ];
  assert.deepEqual(sizeOf(squares), { width: 2, height: 2.6 });
  assert.deepEqual(sizeOf([]), { width: 0, height: 0 });
});

test("blocks that are joined, also by others, are one assembly", () => {
  const joins: Join[] = [
    ["a", 0, "b", 2],
    ["c", 1, "b", 3],
  ];
  assert.deepEqual(
    assemblies(["a", "b", "c", "d"], joins).map((group) => group.sort()),
    [["a", "b", "c"], ["d"]],
  );
  assert.deepEqual(assemblies(["a"], [["a", 0, "gone", 2]]), [["a"]]);
});

test("joined faces give the shape, whichever way the blocks are turned", () => {
  assert.equal(shapeName(["a"], []), "1");
  assert.equal(shapeName(["a", "b"], [["a", 3, "b", 3]]), "2");
  assert.equal(
    shapeName(
      ["a", "b", "c"],
      [
        ["a", 0, "b", 2],
        ["b", 0, "c", 1],
      ],
    ),
    "I3",
  );
  assert.equal(
    shapeName(
      ["a", "b", "c"],
      [
        ["a", 0, "b", 2],
        ["b", 1, "c", 0],
      ],
    ),
    "L3",
  );
  // Three in a row and one on the side of the middle one.
  assert.equal(
    shapeName(
      ["a", "b", "c", "d"],
      [
        ["a", 0, "b", 0],
        ["b", 2, "c", 3],
        ["d", 2, "b", 1],
      ],
    ),
    "T",
  );
  assert.equal(
    shapeName(
      ["a", "b", "c", "d"],
      [
        ["a", 0, "b", 2],
        ["b", 1, "c", 3],
        ["c", 2, "d", 0],
      ],
    ),
    "O",
  );
  assert.equal(shapeName(["a", "b"], []), "2 blocks", "blocks that do not hang together have no shape");
});

test("every placement of every tetromino has its name", () => {
  for (const name of ["I", "O", "T", "S", "Z", "L", "J"]) {
    const cells = cellsOfShape(name);
    for (let quarter = 0; quarter < 4; quarter += 1) {
      const names = cells.map((_, index) => `b${index}`);
      // Blocks that all look the same way: the face towards a neighbour is the direction itself.
      const joins: Join[] = cells.flatMap(([x, y], one) =>
        cells.flatMap(([otherX, otherY], other): Join[] => {
          const face = [
            [1, 0],
            [0, 1],
            [-1, 0],
            [0, -1],
          ].findIndex(([dx, dy]) => otherX - x === dx && otherY - y === dy);
          return face < 0 || other < one
            ? []
            : [[`b${one}`, (face + quarter) % 4, `b${other}`, (face + quarter + 2) % 4]];
        }),
      );
      assert.equal(shapeName(names, joins), name);
    }
  }
  assert.equal(
    code([
      [0, 0],
      [1, 0],
      [0, 1],
    ]),
    "x./xx",
  );
});
