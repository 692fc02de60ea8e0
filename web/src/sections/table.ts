/** A table of text and numbers. */

import type { TableSection } from "../page";
import { table } from "../parts";
import { rich } from "../symbols";
import { short } from "../units";
import { el } from "../dom";

export function drawTable(section: TableSection, body: HTMLElement): void {
  if (section.rows.length === 0) {
    body.append(el("p", { class: "nothing" }, "The table is empty."));
    return;
  }
  const numeric = section.columns.map((_, column) =>
    section.rows.every((row) => typeof row[column] === "number" || row[column] === null),
  );
  const heads = section.columns.map((name) => el("span", {}, ...rich(name)));
  const rows = section.rows.map((row) => row.map(cellText));
  body.append(table(section.title, heads, rows, (column) => numeric[column] === true));
}

function cellText(value: unknown): string {
  if (value === null || value === undefined) return "–";
  if (typeof value === "number") return Number.isInteger(value) ? String(value) : short(value, 4);
  if (typeof value === "boolean") return value ? "yes" : "no";
  return String(value);
}
