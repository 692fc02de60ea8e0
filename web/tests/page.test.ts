import assert from "node:assert/strict";
import test from "node:test";
import { SECTIONS, checkPage, checkState } from "../src/page";
import { isAnother } from "../src/views/connection";
import { checkFrame, checkHello } from "../src/views/live_message";
import { besides, insertAfter, isSmall, sameIds } from "../src/views/order";
import { nextPause, parsed } from "../src/views/socket";
import { sliderScale } from "../src/views/controls";

const PAGE = { format: "driftwalk page", version: 1, view: "report", title: "A run", sections: [] };

test("a page needs little, and what is absent is null", () => {
  const page = checkPage(PAGE);
  assert.equal(page.subtitle, null);
  assert.equal(page.state, null);
  assert.equal(checkPage({ ...PAGE, state: {} }).state?.finished, true);
  assert.equal(checkState({ type: "state", finished: false, progress: 0.5 }).progress, 0.5);
});

test("a page of another kind or version needs another front end", () => {
  const first = checkPage({ ...PAGE, view: "play", driftwalk_version: "1.0.0" });
  assert.equal(isAnother({ ...first, title: "other", subtitle: "other" }, first), false);
  assert.equal(isAnother({ ...first, view: "run" }, first), true);
  assert.equal(isAnother({ ...first, driftwalk_version: "1.0.1" }, first), true);
});

test("what is no page is refused with a reason", () => {
  for (const [value, reason] of [
    [null, /not an object/],
    [{}, /no page of driftwalk/],
    [{ ...PAGE, version: 2 }, /version 2, .* reads version 1/],
    [{ ...PAGE, view: "other" }, /'view' is not one of report, run, live, play: got "other"/],
    [{ ...PAGE, title: 3 }, /'title' is not text: got 3/],
    [{ ...PAGE, sections: [{ id: "a", kind: "table" }] }, /'sections\[0\].title' is not text: got nothing/],
  ] as const) {
    assert.throws(() => checkPage(value), reason);
  }
});

test("a section that is wrong says where", () => {
  const head = { id: "m", kind: "map", title: "Map" };
  const axis = { name: "a", label: "a", unit: "1", values: [1] };
  assert.throws(() => SECTIONS.map(head, ""), /'x' is not an object: got nothing/);
  assert.throws(
    () => SECTIONS.map({ ...head, x: { ...axis, values: [1, "2"] }, y: axis }, ""),
    /'x.values\[1\]' is not a number/,
  );
  assert.throws(
    () => SECTIONS.map({ ...head, x: axis, y: axis, value: { dtype: "f2" } }, ""),
    /'value.shape'/,
  );
  const map = SECTIONS.map({ ...head, x: axis, y: axis, value: [[0.5]], statuses: { "1": "no motion" } }, "");
  assert.equal(map.statuses.get("1"), "no motion");
  assert.equal(map.cells, null);
});

test("a map of outcomes may have its classes over time, or none", () => {
  const axis = { name: "a", label: "a", unit: "1", values: [1] };
  const head = { id: "m", kind: "l1_map", title: "Map", x: axis, y: axis, value: [[0.5]], label: "l1" };
  assert.equal(SECTIONS.l1_map(head, "").over_time, null);
  const kept = { time: [0, 1], classes: ["2"], count: [[[[0, 3]]]], runs: [[3]] };
  assert.equal(SECTIONS.l1_map({ ...head, over_time: kept }, "").over_time?.reference, null);
  assert.throws(
    () => SECTIONS.l1_map({ ...head, over_time: { ...kept, runs: "3" } }, ""),
    /'over_time.runs' is not an object: got "3"/,
  );
});

test("text stays text, whatever it looks like", () => {
  const hostile = "<img src=x onerror=alert(1)>";
  const section = SECTIONS.summary(
    { id: "s", kind: "summary", title: hostile, paragraphs: [hostile], numbers: [] },
    "",
  );
  assert.deepEqual(section.paragraphs, [hostile]);
});

test("new sections stand where they say, else at the end", () => {
  const section = (id: string, after?: string) => ({
    id,
    kind: "empty",
    title: id,
    note: null,
    chapter: null,
    run: null,
    content: { after },
  });
  const page = [section("a"), section("b")];
  assert.deepEqual(
    insertAfter(page, section("c", "a")).map((one) => one.id),
    ["a", "c", "b"],
  );
  assert.deepEqual(
    insertAfter(page, section("c")).map((one) => one.id),
    ["a", "b", "c"],
  );
  assert.ok(sameIds(page, [section("a"), section("b")]) && !sameIds(page, [section("b"), section("a")]));
});

test("small sections stand in pairs, what is left over stands alone", () => {
  const beside = (kinds: readonly string[]): boolean[] =>
    besides(kinds.map((kind) => isSmall({ kind, content: {} })));
  assert.deepEqual(beside(["map", "lines", "lines", "table", "flow", "lines"]), [
    false,
    true,
    true,
    false,
    false,
    false,
  ]);
  assert.deepEqual(beside(["lines", "table", "biplot", "image_grid"]), [true, true, true, true]);
  assert.deepEqual(beside([]), []);
});

test("a table of many columns takes the whole width of the page", () => {
  const columns = (count: number): unknown => ({ columns: Array.from({ length: count }, () => "one") });
  assert.ok(isSmall({ kind: "table", content: columns(3) }));
  assert.ok(!isSmall({ kind: "table", content: columns(4) }));
});

test("only objects with a type are messages, and pauses grow to a limit", () => {
  assert.deepEqual(parsed('{"type":"state","progress":1}'), { type: "state", progress: 1 });
  for (const none of ["", "{", "[]", "3", "null", '{"type":3}', new ArrayBuffer(2)])
    assert.equal(parsed(none), null);
  let pause = 250;
  const pauses = Array.from({ length: 8 }, () => (pause = nextPause(pause)));
  assert.deepEqual(pauses, [500, 1000, 2000, 4000, 5000, 5000, 5000, 5000]);
});

test("frames of a tracker are read, with what is unknown as null", () => {
  const body = { id: "3", seen: false, x_m: 0.1, y_m: null, theta_rad: null, column_px: null };
  const frame = checkFrame({
    type: "frame",
    frame: 7,
    time_s: 0.5,
    bodies: [body],
    joined: [["3", 0, "4", 2]],
    outcome: null,
  });
  assert.deepEqual(frame.joined, [["3", 0, "4", 2]]);
  assert.equal(frame.bodies[0]?.y_m, null);
  assert.equal(checkFrame({ frame: 1, time_s: 0, bodies: [], joined: null }).joined, null);
  assert.throws(() => checkFrame({ frame: 1, time_s: 0, bodies: [{}] }), /'bodies\[0\].id'/);
  assert.equal(checkHello({ tank: { shape: "circle", diameter_m: 0.3 } }, "").tank?.shape, "circle");
});

test("an image that cannot be placed costs the video, not the stream", () => {
  const tank = { shape: "circle", diameter_m: 0.3 };
  const image = { width_px: 640, height_px: 480, homography_px_to_m: [1, 0, 0, 0, 1, 0, 0, 0, 1] };
  const good = checkHello({ tank, image }, "");
  assert.equal(good.image?.width_px, 640);
  assert.equal(good.imageFault, null);
  assert.equal(checkHello({ tank }, "").imageFault, null);
  for (const [odd, reason] of [
    [{ ...image, width_px: undefined }, "'image.width_px' is not a number: got nothing"],
    [{ ...image, height_px: 0 }, "'image.height_px' is not above 0: got 0"],
    [{ ...image, homography_px_to_m: undefined }, "'image.homography_px_to_m' is not a list: got nothing"],
    [{ ...image, homography_px_to_m: [1, 2] }, "'image.homography_px_to_m' does not have 9 numbers: got 2"],
    ["640x480", "'image' is not an object: got \"640x480\""],
  ] as const) {
    const hello = checkHello({ tank, image: odd }, "");
    assert.equal(hello.tank?.shape, "circle");
    assert.equal(hello.image, null);
    assert.equal(hello.imageFault, reason);
  }
  assert.throws(() => checkHello({ tank: 3, image }, ""), /'tank'/);
});

test("a slider reaches both ends and gives values that can be read", () => {
  const drag = sliderScale(0, 1.5, 0.01, false);
  assert.equal(drag.steps, 150);
  assert.equal(drag.value(drag.steps), 1.5);
  assert.equal(drag.value(drag.place(0.45)), 0.45);
  assert.equal(drag.value(29), 0.29);
  const speed = sliderScale(0.25, 60, 0.01, true);
  assert.equal(speed.value(0), 0.25);
  assert.equal(speed.value(speed.steps), 60);
  assert.ok(Math.abs(speed.value(speed.place(1)) - 1) < 0.01);
});
