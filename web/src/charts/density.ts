/** The joint density of step length and turning angle, with a cross where two differ most. */

import { type Grid, at, extent } from "../arrays";
import { colourScale } from "../colours";
import { svg } from "../dom";
import { isDark } from "../theme";
import { type Display, displayFor } from "../units";
import { drawCells } from "./cells";
import { BAR_ROOM, drawColourBar } from "./colour_bar";
import { makeFrame } from "./frame";

/** Share of the steps that the axes reach over; one wild step must not squeeze the rest. */
const SHOWN = 0.9995;
/** Colour grows with the root of the density: the tails show, and so does the peak. */
const POWER = 0.5;

export interface Bins {
  readonly length: readonly number[];
  readonly angle: readonly number[];
}

/** What several densities have in common, so that they can be compared. */
export interface DensityLook {
  readonly bins: Bins;
  readonly length: readonly [number, number];
  readonly angle: readonly [number, number];
  readonly lengthDisplay: Display;
  readonly angleDisplay: Display;
  /** Top of the colour scale [% per shown unit of length and angle]. */
  readonly top: number;
}

export interface DensityPlot {
  readonly width: number;
  /** Share of the steps in each bin, shape (lengths, angles). */
  readonly share: Grid;
  readonly look: DensityLook;
  readonly label: string;
  readonly cross?: { readonly length: number; readonly angle: number } | null;
  readonly bar?: boolean;
}

/** Returns axes and colours that fit all of the densities. */
export function densityLook(bins: Bins, shares: readonly Grid[]): DensityLook {
  const lengthDisplay = displayFor("m", bins.length);
  const angleDisplay = displayFor("rad", bins.angle);
  const lengths = shares.map((share) => filledRange(marginal(share, 0), bins.length));
  const angles = shares.map((share) => filledRange(marginal(share, 1), bins.angle));
  const around = (ranges: (readonly [number, number])[]): [number, number] => extent(ranges.flat()) ?? [0, 1];
  const sizes = { bins, lengthDisplay, angleDisplay };
  const tops = shares.map((share) => extent(densities(share, sizes))?.[1] ?? 0);
  return { ...sizes, length: around(lengths), angle: around(angles), top: Math.max(...tops) || 1 };
}

/** Returns the sum over the other axis, not a number counting as nothing. */
export function marginal(share: Grid, axis: 0 | 1): number[] {
  const [rows = 0, columns = 0] = share.shape;
  const sums = new Array<number>(axis === 0 ? rows : columns).fill(0);
  share.data.forEach((value, index) => {
    const place = axis === 0 ? Math.floor(index / columns) : index % columns;
    sums[place] = at(sums, place) + (Number.isFinite(value) ? value : 0);
  });
  return sums;
}

/** Returns the outer edges of the bins that hold the central 99.95 % of a marginal. */
export function filledRange(shares: readonly number[], edges: readonly number[]): [number, number] {
  const total = shares.reduce((sum, share) => sum + share, 0);
  if (!(total > 0)) return [edges[0] ?? 0, edges.at(-1) ?? 1];
  const tail = ((1 - SHOWN) / 2) * total;
  let [first, below] = [0, 0];
  while (first < shares.length - 1 && below + at(shares, first) <= tail) below += at(shares, first++);
  let [last, above] = [shares.length - 1, 0];
  while (last > first && above + at(shares, last) <= tail) above += at(shares, last--);
  return [edges[first] ?? 0, edges[last + 1] ?? 1];
}

export function drawDensity(plot: DensityPlot): SVGSVGElement {
  const { look, share } = plot;
  const frame = makeFrame({
    width: plot.width,
    height: Math.max(110, plot.width * 0.62),
    x: { domain: look.length, label: "step length", display: look.lengthDisplay },
    y: { domain: look.angle, label: "turning angle", display: look.angleDisplay },
    label: plot.label,
    ...(plot.bar === true ? { right: BAR_ROOM } : {}),
  });
  const scale = colourScale("density", 0, look.top, { power: POWER, dark: isDark() });
  const values = densities(share, look);
  const angles = share.shape[1] ?? 0;
  drawCells(frame, look.bins.length, look.bins.angle, (column, row) => {
    const value = at(values, column * angles + row);
    return value > 0 ? scale.of(value) : null;
  });
  const zero = frame.y.px(0);
  frame.plot.append(
    svg("line", { class: "zero", x1: frame.left, x2: frame.left + frame.width, y1: zero, y2: zero }),
  );
  const cross = plot.cross;
  if (cross !== undefined && cross !== null && Number.isFinite(cross.length + cross.angle)) {
    frame.front.append(crossAt(frame.x.px(cross.length), frame.y.px(cross.angle)));
  }
  if (plot.bar === true) {
    const label = `density (% per ${look.lengthDisplay.unit} and °)`;
    drawColourBar(frame, { scale, label, display: { factor: 1, unit: "" } });
  }
  return frame.svg;
}

function crossAt(x: number, y: number): SVGElement {
  const d = `M${x - 6} ${y - 6}L${x + 6} ${y + 6}M${x + 6} ${y - 6}L${x - 6} ${y + 6}`;
  return svg("g", { class: "cross" }, svg("path", { d, class: "edge" }), svg("path", { d }));
}

/** Returns shares per bin as densities [% per shown unit], whatever the sizes of the bins. */
function densities(
  share: Grid,
  look: Pick<DensityLook, "bins" | "lengthDisplay" | "angleDisplay">,
): Float64Array {
  const angles = share.shape[1] ?? 0;
  const { bins, lengthDisplay, angleDisplay } = look;
  return share.data.map((value, index) => {
    const [length, angle] = [Math.floor(index / angles), index % angles];
    const wide = (at(bins.length, length + 1) - at(bins.length, length)) * lengthDisplay.factor;
    const high = (at(bins.angle, angle + 1) - at(bins.angle, angle)) * angleDisplay.factor;
    return Number.isFinite(value) ? (100 * value) / (wide * high) : 0;
  });
}
