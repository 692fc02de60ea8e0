import assert from "node:assert/strict";
import test from "node:test";
import { type Lens, imageBox, pixelToTank, straightened } from "../src/tank/video";

const LENS: Lens = {
  focal_x_px: 800,
  focal_y_px: 790,
  centre_column_px: 321,
  centre_row_px: 239,
  k1: -0.22,
  k2: 0.05,
  k3: -0.01,
  p1: 0.001,
  p2: -0.0007,
};

/** The distortion as OpenCV's documentation writes it: the oracle for its inverse. */
function bent(lens: Lens, column: number, row: number): [number, number] {
  const x = (column - lens.centre_column_px) / lens.focal_x_px;
  const y = (row - lens.centre_row_px) / lens.focal_y_px;
  const r2 = x ** 2 + y ** 2;
  const radial = 1 + lens.k1 * r2 + lens.k2 * r2 ** 2 + lens.k3 * r2 ** 3;
  const bentX = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x ** 2);
  const bentY = y * radial + lens.p1 * (r2 + 2 * y ** 2) + 2 * lens.p2 * x * y;
  return [bentX * lens.focal_x_px + lens.centre_column_px, bentY * lens.focal_y_px + lens.centre_row_px];
}

test("straightening undoes the lens", () => {
  for (const [column, row] of [
    [0, 0],
    [639, 479],
    [321, 239],
    [100, 400],
    [600, 20],
  ] as const) {
    const [x, y] = straightened(LENS, ...bent(LENS, column, row));
    assert.ok(Math.hypot(x - column, y - row) < 0.01, `${column}, ${row} became ${x}, ${y}`);
  }
});

test("a homography takes pixels to metres, up to a factor, rows downwards", () => {
  const homography = [0.001, 0, -0.32, 0, -0.001, 0.24, 0, 0, 1];
  const camera = { width: 640, height: 480, homography, lens: null };
  const [x, y] = pixelToTank(camera, 420, 140);
  assert.ok(Math.abs(x - 0.1) < 1e-12 && Math.abs(y - 0.1) < 1e-12);
  const doubled = { ...camera, homography: homography.map((entry) => 2 * entry) };
  assert.deepEqual(
    pixelToTank(doubled, 420, 140).map((v) => v.toFixed(9)),
    [x, y].map((v) => v.toFixed(9)),
  );
  const box = imageBox(camera);
  assert.deepEqual(
    [...box.x, ...box.y].map((end) => Number(end.toFixed(9))),
    [-0.32, 0.32, -0.24, 0.24],
  );
});
