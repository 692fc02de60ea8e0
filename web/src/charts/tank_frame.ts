/** A plot of the tank seen from above: equal scales, outline, optionally without axes. */

import { freshId, svg } from "../dom";
import type { Arena } from "../page";
import { type Box, closedPath, outline } from "../tank/outline";
import { multiples, niceStep } from "../scale";
import { type Display, displayFor, fixed, stepDecimals } from "../units";
import { type Frame, type Tick, makeFrame } from "./frame";

export function makeTankFrame(
  width: number,
  box: Box,
  options: { label: string; right?: number; axes?: boolean },
): Frame {
  const display = displayFor("m", [...box.x, ...box.y]);
  const axes = options.axes ?? true;
  const ticks = axes ? commonTicks(box, display, width) : { x: [], y: [] };
  const frame = makeFrame({
    width,
    x: { domain: box.x, label: axes ? "x" : "", display, ticks: ticks.x },
    y: { domain: box.y, label: axes ? "y" : "", display, ticks: ticks.y },
    label: options.label,
    ...(options.right === undefined ? {} : { right: options.right }),
  });
  if (!axes) frame.svg.classList.add("bare");
  return frame;
}

/** Returns ticks with one step for both axes, whose scales are equal. */
function commonTicks(box: Box, display: Display, width: number): { x: Tick[]; y: Tick[] } {
  const { factor } = display;
  const widest = Math.max(box.x[1] - box.x[0], box.y[1] - box.y[0]) * factor;
  const step = niceStep(widest, Math.min(8, Math.max(3, (width - 100) / 46)));
  const decimals = stepDecimals(step);
  const along = (range: readonly [number, number]): Tick[] =>
    multiples(range[0] * factor, range[1] * factor, step).map((tick) => ({
      at: tick / factor,
      text: fixed(tick, decimals),
    }));
  return { x: along(box.x), y: along(box.y) };
}

/** Returns a group in which nothing is seen outside of the tank. */
export function insideTank(frame: Frame, arena: Arena | null): SVGGElement {
  const d = closedPath(outline(arena), frame.x.px, frame.y.px);
  const group = svg("g");
  if (d !== "") {
    const id = freshId("inside");
    frame.defs.append(svg("clipPath", { id }, svg("path", { d })));
    group.setAttribute("clip-path", `url(#${id})`);
  }
  frame.plot.append(group);
  return group;
}

/** Draws the outline of the tank over what is there. */
export function drawOutline(frame: Frame, arena: Arena | null): void {
  const path = closedPath(outline(arena), frame.x.px, frame.y.px);
  if (path !== "") frame.plot.append(svg("path", { class: "tank", d: path }));
}
