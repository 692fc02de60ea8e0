/** The outcome classes as a graph, by their number of assemblies, and the rates between them. */

import { figure } from "../charts/responsive";
import { type Context, classColours } from "../context";
import { svg } from "../dom";
import type { ClassGraphSection } from "../page";
import { drawSketch, sizeOf, writtenName } from "../polyomino";

const RADIUS = 19;
/** Room about the middles of the outermost classes, below more: the name of a class. */
const ROOM = { aside: 30, above: 24, below: 40 };

export function drawClassGraph(section: ClassGraphSection, body: HTMLElement, context: Context): void {
  figure(body, "wide", (width) => drawGraph(width, section, context));
}

function drawGraph(width: number, section: ClassGraphSection, context: Context): SVGSVGElement {
  const high = section.height;
  const x = (share: number): number => ROOM.aside + share * (width - 2 * ROOM.aside);
  const y = (share: number): number => ROOM.above + (1 - share) * (high - ROOM.above - ROOM.below);
  const picture = svg("svg", {
    class: "plot",
    role: "img",
    viewBox: `0 0 ${width} ${high}`,
    "aria-label": `Graph of ${section.classes.length} outcome classes; the table of rates has its numbers`,
  });
  // Words above all arrows: none crosses a number.
  const words: SVGElement[] = [];
  for (const arrow of section.arrows) {
    const [x0, y0, x1, y1] = [x(arrow.x[0]), y(arrow.y[0]), x(arrow.x[1]), y(arrow.y[1])];
    picture.append(drawArrow(x0, y0, x1, y1, 0.8 + 4 * arrow.share));
    // On a phone there is room for the numbers of wide arrows; the table of rates has all.
    if (width < 560 && arrow.share < 0.25) continue;
    const [left, top] = [x0 + arrow.at * (x1 - x0), y0 + arrow.at * (y1 - y0)];
    words.push(svg("text", { class: "halo", x: left, y: top + 4, "text-anchor": "middle" }, arrow.label));
  }
  for (const one of section.classes) {
    const [left, top] = [x(one.x), y(one.y)];
    const size = sizeOf(one.cells);
    const side = Math.min(7, 26 / Math.max(size.width, size.height));
    const colour = classColours(context).of(one.class);
    const circle = svg("circle", { class: "state", cx: left, cy: top, r: RADIUS });
    circle.style.setProperty("stroke", colour);
    const corner = [left - (size.width * side) / 2, top - (size.height * side) / 2] as const;
    picture.append(circle, drawSketch(one.cells, ...corner, side, colour));
    words.push(
      svg("text", { class: "halo", x: left, y: top + RADIUS + 13, "text-anchor": "middle" }, writtenName(one.class)),
    );
  }
  picture.append(...words);
  return picture;
}

function drawArrow(x0: number, y0: number, x1: number, y1: number, wide: number): SVGElement {
  const length = Math.hypot(x1 - x0, y1 - y0);
  const [cos, sin] = [(x1 - x0) / length, (y1 - y0) / length];
  const head = 5 + 1.5 * wide;
  const point = (along: number, aside: number): string =>
    `${(x0 + along * cos - aside * sin).toFixed(1)} ${(y0 + along * sin + aside * cos).toFixed(1)}`;
  const [begin, neck, end] = [RADIUS + 2, Math.max(RADIUS + 2, length - RADIUS - 2 - head), length - RADIUS - 2];
  const [half, barb] = [wide / 2, wide / 2 + 2.5];
  const corners = [
    [begin, half],
    [neck, half],
    [neck, barb],
    [end, 0],
    [neck, -barb],
    [neck, -half],
    [begin, -half],
  ] as const;
  return svg("path", { class: "transition", d: `M${corners.map(([along, aside]) => point(along, aside)).join("L")}Z` });
}
