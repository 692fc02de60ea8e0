/** A video frame laid under the tank: straightened, and brought into the tank's plane. */

import type { View } from "./canvas";
import type { Box, Point } from "./outline";

export interface Lens {
  readonly focal_x_px: number;
  readonly focal_y_px: number;
  readonly centre_column_px: number;
  readonly centre_row_px: number;
  readonly k1: number;
  readonly k2: number;
  readonly k3: number;
  readonly p1: number;
  readonly p2: number;
}

/** How an image lies under the tank. */
export interface Camera {
  readonly width: number;
  readonly height: number;
  /** Straightened pixel (column, row, 1) to (x, y, 1) [m] up to a factor, row by row. */
  readonly homography: readonly number[];
  readonly lens: Lens | null;
}

/** Cells of the mesh on which an image is bent, along its longer side. */
const MESH = 16;
const ROUNDS = 12;

/** Returns where a pixel of the image lies in the tank [m]; pixel centres are at whole numbers. */
export function pixelToTank(camera: Camera, column: number, row: number): Point {
  const [straightColumn, straightRow] =
    camera.lens === null ? [column, row] : straightened(camera.lens, column, row);
  const [a = 0, b = 0, c = 0, d = 0, e = 0, f = 0, g = 0, h = 0, i = 1] = camera.homography;
  const scale = g * straightColumn + h * straightRow + i;
  return [
    (a * straightColumn + b * straightRow + c) / scale,
    (d * straightColumn + e * straightRow + f) / scale,
  ];
}

/** Returns where a pixel would lie without the lens's distortion, as OpenCV defines it. */
export function straightened(lens: Lens, column: number, row: number): Point {
  const bentX = (column - lens.centre_column_px) / lens.focal_x_px;
  const bentY = (row - lens.centre_row_px) / lens.focal_y_px;
  let [x, y] = [bentX, bentY];
  // The distortion has no closed inverse: what it adds at the last guess is taken away.
  for (let round = 0; round < ROUNDS; round += 1) {
    const square = x * x + y * y;
    const radial = 1 + square * (lens.k1 + square * (lens.k2 + square * lens.k3));
    const asideX = 2 * lens.p1 * x * y + lens.p2 * (square + 2 * x * x);
    const asideY = lens.p1 * (square + 2 * y * y) + 2 * lens.p2 * x * y;
    [x, y] = [(bentX - asideX) / radial, (bentY - asideY) / radial];
  }
  return [x * lens.focal_x_px + lens.centre_column_px, y * lens.focal_y_px + lens.centre_row_px];
}

/** Returns the box of the whole image in the tank's plane. */
export function imageBox(camera: Camera): Box {
  const corners = [
    [0, 0],
    [camera.width, 0],
    [camera.width, camera.height],
    [0, camera.height],
  ].map(([column = 0, row = 0]) => pixelToTank(camera, column, row));
  const [xs, ys] = [corners.map((corner) => corner[0]), corners.map((corner) => corner[1])];
  return { x: [Math.min(...xs), Math.max(...xs)], y: [Math.min(...ys), Math.max(...ys)] };
}

/** Draws an image so that each of its points lies where it is in the tank. */
export function drawVideo(view: View, image: HTMLImageElement, camera: Camera): void {
  const [columns, rows] = meshSize(camera);
  const zoom = image.naturalWidth / camera.width;
  const node = (across: number, down: number): readonly [Point, Point] => {
    const [column, row] = [(camera.width * across) / columns, (camera.height * down) / rows];
    const [x, y] = pixelToTank(camera, column - 0.5, row - 0.5);
    return [
      [column * zoom, row * zoom],
      [view.px(x), view.py(y)],
    ];
  };
  for (let down = 0; down < rows; down += 1) {
    for (let across = 0; across < columns; across += 1) {
      const corners = [
        node(across, down),
        node(across + 1, down),
        node(across, down + 1),
        node(across + 1, down + 1),
      ] as const;
      drawTriangle(view.context, image, corners[0], corners[1], corners[2]);
      drawTriangle(view.context, image, corners[3], corners[2], corners[1]);
    }
  }
}

/** Returns a mesh of one cell when the image is only turned, moved and scaled. */
function meshSize(camera: Camera): [number, number] {
  const [, , , , , , g = 0, h = 0, i = 1] = camera.homography;
  const bend = (Math.abs(g) * camera.width + Math.abs(h) * camera.height) / Math.abs(i || 1);
  if (camera.lens === null && bend < 1e-4) return [1, 1];
  return [MESH, Math.max(1, Math.round((MESH * camera.height) / camera.width))];
}

/** Draws a triangle of an image; each corner is its place in the image and on the canvas. */
function drawTriangle(
  context: CanvasRenderingContext2D,
  image: HTMLImageElement,
  [fromA, toA]: readonly [Point, Point],
  [fromB, toB]: readonly [Point, Point],
  [fromC, toC]: readonly [Point, Point],
): void {
  const [bx, by, cx, cy] = [
    fromB[0] - fromA[0],
    fromB[1] - fromA[1],
    fromC[0] - fromA[0],
    fromC[1] - fromA[1],
  ];
  const area = bx * cy - cx * by;
  if (area === 0) return;
  const solve = (axis: 0 | 1): readonly [number, number, number] => {
    const [b, c] = [toB[axis] - toA[axis], toC[axis] - toA[axis]];
    const [across, down] = [(b * cy - c * by) / area, (c * bx - b * cx) / area];
    return [across, down, toA[axis] - across * fromA[0] - down * fromA[1]];
  };
  const [a, c, e] = solve(0);
  const [b, d, f] = solve(1);
  context.save();
  context.beginPath();
  for (const [x, y] of grown([toA, toB, toC])) context.lineTo(x, y);
  context.closePath();
  context.clip();
  context.transform(a, b, c, d, e, f);
  context.drawImage(image, 0, 0);
  context.restore();
}

/** Returns a triangle a little larger, so that no seam shows between neighbours. */
function grown(corners: readonly [Point, Point, Point]): Point[] {
  const x = (corners[0][0] + corners[1][0] + corners[2][0]) / 3;
  const y = (corners[0][1] + corners[1][1] + corners[2][1]) / 3;
  return corners.map((corner): Point => {
    const length = Math.hypot(corner[0] - x, corner[1] - y) || 1;
    const factor = 1 + 0.7 / length;
    return [x + (corner[0] - x) * factor, y + (corner[1] - y) * factor];
  });
}
