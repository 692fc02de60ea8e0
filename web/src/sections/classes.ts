/** How often each outcome class occurs. */

import { type ClassRow, drawClassBars } from "../charts/class_bars";
import { figure } from "../charts/responsive";
import { el } from "../dom";
import type { ClassesSection } from "../page";
import { details, legend, table } from "../parts";
import { percent } from "../units";

const COLOURS = ["var(--blue)", "var(--orange)", "var(--green)", "var(--muted)"] as const;

export function drawClasses(section: ClassesSection, body: HTMLElement): void {
  const rows = classRows(section);
  if (rows.length === 0) {
    body.append(el("p", { class: "nothing" }, "No run has ended yet."));
    return;
  }
  const holder = el("div", { class: "wide" });
  body.append(holder);
  const shares = rows.map((row) => `${row.name} ${percent(row.bars[0]?.share ?? Number.NaN)}`);
  const label = `Shares of the outcome classes: ${shares.join(", ")}`;
  figure(holder, "", (width) => drawClassBars(width, rows, label));
  if (section.series.length > 1) {
    holder.append(
      legend(
        section.series.map((series, index) => ({
          swatch: "solid" as const,
          colour: colourOf(index),
          text: series.name,
        })),
      ),
    );
  }
  holder.append(details("Values as a table", () => valueTable(section)));
}

function classRows(section: ClassesSection): ClassRow[] {
  const names = new Set(section.series.flatMap((series) => series.items.map((item) => item.class)));
  return [...names].map((name) => {
    const items = section.series.map((series) => series.items.find((item) => item.class === name));
    const known = items.find((item) => item !== undefined);
    return {
      name,
      cells: known?.cells ?? [],
      note: known?.note ?? null,
      bars: items.map((item, index) =>
        item === undefined || item.share === null
          ? null
          : { share: item.share, low: item.low, high: item.high, count: item.count, colour: colourOf(index) },
      ),
    };
  });
}

function colourOf(series: number): string {
  return COLOURS[series % COLOURS.length] ?? COLOURS[0];
}

function valueTable(section: ClassesSection): HTMLElement {
  const rows = section.series.flatMap((series) =>
    series.items.map((item) => [
      series.name,
      item.class,
      item.count === null ? "–" : String(item.count),
      item.share === null ? "–" : percent(item.share),
      item.low === null ? "–" : percent(item.low),
      item.high === null ? "–" : percent(item.high),
    ]),
  );
  return table(
    section.title,
    ["series", "class", "runs", "share", "from", "to"],
    rows,
    (column) => column > 1,
  );
}
