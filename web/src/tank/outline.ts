/** The outline of the tank as points. */

import { extent } from "../arrays";
import type { Arena } from "../page";

export type Point = readonly [number, number];

/** Box around something: left, right, bottom, top [m]. */
export interface Box {
  readonly x: readonly [number, number];
  readonly y: readonly [number, number];
}

const CIRCLE_POINTS = 180;

/** Returns the corners of the outline [m], counter-clockwise; none when the arena is not known. */
export function outline(arena: Arena | null): Point[] {
  if (arena === null) return [];
  const [x, y] = arena.center_m ?? [0, 0];
  switch (arena.shape) {
    case "circle": {
      const radius = (arena.diameter_m ?? 0) / 2;
      return Array.from({ length: CIRCLE_POINTS }, (_, index): Point => {
        const angle = (2 * Math.PI * index) / CIRCLE_POINTS;
        return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
      });
    }
    case "rectangle": {
      const [right, up] = [(arena.width_m ?? 0) / 2, (arena.height_m ?? 0) / 2];
      return [
        [x - right, y - up],
        [x + right, y - up],
        [x + right, y + up],
        [x - right, y + up],
      ];
    }
    case "polygon":
      return arena.vertices_m ?? [];
  }
}

/** Returns a box around the tank, or around positions when there is no tank, with a margin. */
export function boxAround(
  arena: Arena | null,
  x: Iterable<number> = [],
  y: Iterable<number> = [],
  margin = 0.03,
): Box {
  const corners = outline(arena);
  const known = corners.length > 0;
  const across = extent(known ? corners.map((corner) => corner[0]) : x) ?? [-0.5, 0.5];
  const up = extent(known ? corners.map((corner) => corner[1]) : y) ?? [-0.5, 0.5];
  const room = margin * Math.max(across[1] - across[0], up[1] - up[0], 1e-6);
  return { x: [across[0] - room, across[1] + room], y: [up[0] - room, up[1] + room] };
}

/** Returns the data of a closed path through corners. */
export function closedPath(
  corners: readonly Point[],
  px: (x: number) => number,
  py: (y: number) => number,
): string {
  if (corners.length === 0) return "";
  return `M${corners.map(([x, y]) => `${px(x).toFixed(1)} ${py(y).toFixed(1)}`).join("L")}Z`;
}
