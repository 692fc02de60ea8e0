import assert from "node:assert/strict";
import test from "node:test";
import { HeldFrame } from "../src/views/held";

function holder(): { taken: number[]; held: HeldFrame<number> } {
  const taken: number[] = [];
  return { taken, held: new HeldFrame((frame: number) => taken.push(frame)) };
}

test("only the newest of the frames that wait is taken, once", () => {
  const { taken, held } = holder();
  for (const frame of [1, 2, 3]) held.hold(frame, 60_000);
  assert.deepEqual(taken, []);
  held.flush();
  held.flush();
  assert.deepEqual(taken, [3]);
});

test("a frame that waits gives way to a newer one", () => {
  const { taken, held } = holder();
  held.hold(1, 60_000);
  held.drop();
  held.flush();
  assert.deepEqual(taken, []);
});

test("a frame that nothing follows is taken when patience ends", async () => {
  const taken = await new Promise<number>((done) => new HeldFrame(done).hold(7, 5));
  assert.equal(taken, 7);
});
