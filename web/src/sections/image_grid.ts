/** A field over two axes, coloured; with the outline of the tank when it is one of positions. */

import { at, decode, extent } from "../arrays";
import { addHatch, cellsPath, drawCells } from "../charts/cells";
import { BAR_ROOM, drawColourBar } from "../charts/colour_bar";
import { type Frame, makeFrame } from "../charts/frame";
import { onPointer } from "../charts/hover";
import { figure } from "../charts/responsive";
import { drawOutline, insideTank, makeTankFrame } from "../charts/tank_frame";
import { type ColourScale, colourScale } from "../colours";
import { el, svg } from "../dom";
import type { ImageGridSection } from "../page";
import { details, readout, table } from "../parts";
import { cellAt, cellEdges } from "../scale";
import { shortName, spoken } from "../symbols";
import { boxAround } from "../tank/outline";
import { isDark } from "../theme";
import { displayFor, inUnit, labelled, short } from "../units";

export async function drawImageGrid(section: ImageGridSection, body: HTMLElement): Promise<void> {
  const { x, y } = section;
  const value = (await decode(section.value)).data;
  const [xEdges, yEdges] = [cellEdges(x.values), cellEdges(y.values)];
  const display = displayFor(section.unit, value);
  const [xDisplay, yDisplay] = [displayFor(x.unit, x.values), displayFor(y.unit, y.values)];
  const columns = x.values.length;
  const line = readout("Point at the field to read values.");
  const holder = el("div", { class: "one" });
  body.append(holder);
  figure(holder, "", (width) => {
    const scale = scaleOf(section, value);
    const frame = frameOf(width, section, xEdges, yEdges);
    const inside = insideTank(frame, section.arena);
    drawCells(frame, xEdges, yEdges, (column, row) => scale.of(at(value, row * columns + column)), inside);
    if (section.arena === null) drawMissing(frame, xEdges, yEdges, value, columns);
    else drawOutline(frame, section.arena);
    drawColourBar(frame, { scale, label: labelled(section.label, display), display });
    onPointer(frame, (place) => {
      const [column, row] = place === null ? [-1, -1] : [cellAt(xEdges, place.x), cellAt(yEdges, place.y)];
      const found = column < 0 || row < 0 ? Number.NaN : at(value, row * columns + column);
      line.show(
        Number.isFinite(found)
          ? [
              [shortName(x.label), inUnit(at(x.values, column), xDisplay)],
              [shortName(y.label), inUnit(at(y.values, row), yDisplay)],
              [section.label, inUnit(found, display)],
            ]
          : null,
      );
    });
    return frame.svg;
  });
  const asTable = (): HTMLElement =>
    table(
      section.title,
      [`${spoken(y.label)} \\ ${spoken(x.label)}`, ...x.values.map((one) => short(one * xDisplay.factor))],
      y.values.map((one, row) => [
        short(one * yDisplay.factor),
        ...x.values.map((_, column) => short(at(value, row * columns + column) * display.factor)),
      ]),
      () => true,
    );
  holder.append(line.element, details("Values as a table", asTable));
}

function scaleOf(section: ImageGridSection, value: Float64Array): ColourScale {
  const [low, high] = section.limits ?? extent(value) ?? [0, 1];
  if (!section.diverging) return colourScale("magnitude", low, high);
  const reach = Math.max(Math.abs(low), Math.abs(high)) || 1;
  return colourScale("signed", -reach, reach, { dark: isDark() });
}

function frameOf(width: number, section: ImageGridSection, xEdges: number[], yEdges: number[]): Frame {
  const { x, y } = section;
  const label = `${section.title}: ${section.label} over ${spoken(x.label)} and ${spoken(y.label)}`;
  if (section.arena !== null) {
    return makeTankFrame(width, boxAround(section.arena), { label, right: BAR_ROOM });
  }
  return makeFrame({
    width,
    height: Math.min(400, Math.max(180, width * 0.68)),
    x: { domain: ends(xEdges), label: x.label, display: displayFor(x.unit, x.values) },
    y: { domain: ends(yEdges), label: y.label, display: displayFor(y.unit, y.values) },
    right: BAR_ROOM,
    label,
  });
}

function ends(edges: number[]): [number, number] {
  return [edges[0] ?? 0, edges.at(-1) ?? 1];
}

function drawMissing(
  frame: Frame,
  xEdges: number[],
  yEdges: number[],
  value: Float64Array,
  columns: number,
): void {
  const missing: [number, number][] = [];
  value.forEach((one, index) => {
    if (!Number.isFinite(one)) missing.push([index % columns, Math.floor(index / columns)]);
  });
  const path = cellsPath(frame, xEdges, yEdges, missing);
  if (path !== "") frame.plot.append(svg("path", { d: path, fill: addHatch(frame, { gap: 6 }) }));
}
