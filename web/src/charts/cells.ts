/** Cells of a grid: coloured, hatched, outlined. */

import { type Rgb, css } from "../colours";
import { type Attributes, freshId, svg } from "../dom";
import type { Frame } from "./frame";

/** Pixels of the picture per pixel of the page, for sharp cells on fine screens and on paper. */
const FINENESS = 2;

type ColourAt = (column: number, row: number) => Rgb | null;

/** Draws cells between edges as one picture; a cell without a colour stays transparent. */
export function drawCells(
  frame: Frame,
  xEdges: readonly number[],
  yEdges: readonly number[],
  colourAt: ColourAt,
  into: SVGGElement = frame.plot,
): void {
  const canvas = document.createElement("canvas");
  canvas.width = Math.ceil(frame.width * FINENESS);
  canvas.height = Math.ceil(frame.height * FINENESS);
  const context = canvas.getContext("2d");
  if (context === null) return;
  const across = xEdges.map((edge) => Math.round((frame.x.px(edge) - frame.left) * FINENESS));
  const down = yEdges.map((edge) => Math.round((frame.y.px(edge) - frame.top) * FINENESS));
  for (let row = 0; row + 1 < down.length; row += 1) {
    for (let column = 0; column + 1 < across.length; column += 1) {
      const colour = colourAt(column, row);
      if (colour === null) continue;
      const [x0 = 0, x1 = 0] = [across[column], across[column + 1]];
      const [y0 = 0, y1 = 0] = [down[row], down[row + 1]];
      context.fillStyle = css(colour);
      context.fillRect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0));
    }
  }
  into.append(
    svg("image", {
      href: canvas.toDataURL("image/png"),
      x: frame.left,
      y: frame.top,
      width: frame.width,
      height: frame.height,
      preserveAspectRatio: "none",
    }),
  );
}

/** Returns the outline of some cells as the data of a path. */
export function cellsPath(
  frame: Frame,
  xEdges: readonly number[],
  yEdges: readonly number[],
  cells: Iterable<readonly [column: number, row: number]>,
): string {
  const parts: string[] = [];
  for (const [column, row] of cells) {
    const x0 = frame.x.px(xEdges[column] ?? 0);
    const x1 = frame.x.px(xEdges[column + 1] ?? 0);
    const y0 = frame.y.px(yEdges[row] ?? 0);
    const y1 = frame.y.px(yEdges[row + 1] ?? 0);
    parts.push(`M${round(x0)} ${round(y0)}H${round(x1)}V${round(y1)}H${round(x0)}Z`);
  }
  return parts.join("");
}

/** Adds a pattern of slanted lines and returns how to fill with it. */
export function addHatch(
  frame: Frame,
  options: { slant?: number; gap?: number; class?: string; paper?: boolean } = {},
): string {
  const id = freshId("hatch");
  const gap = options.gap ?? 5;
  const pattern: Attributes = {
    id,
    width: gap,
    height: gap,
    patternUnits: "userSpaceOnUse",
    patternTransform: `rotate(${options.slant ?? 45})`,
  };
  frame.defs.append(
    svg(
      "pattern",
      pattern,
      // Lines alone cannot be seen on a dark colour.
      options.paper === true && svg("rect", { class: "paper", width: gap, height: gap }),
      svg("line", { class: options.class ?? "hatch", x1: 0, x2: 0, y1: 0, y2: gap }),
    ),
  );
  return `url(#${id})`;
}

export function round(px: number): number {
  return Math.round(px * 10) / 10;
}
