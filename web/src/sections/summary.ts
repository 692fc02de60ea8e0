/** What was done, in a paragraph, and the numbers with their uncertainty. */

import { el } from "../dom";
import type { SummarySection } from "../page";
import { rich } from "../symbols";
import { percent, valueAndInterval } from "../units";

type Item = SummarySection["numbers"][number];

export function drawSummary(section: SummarySection, body: HTMLElement): void {
  for (const paragraph of section.paragraphs) body.append(el("p", { class: "lead" }, ...rich(paragraph)));
  if (section.numbers.length > 0) {
    body.append(el("dl", { class: "numbers" }, ...section.numbers.map(card)));
  }
}

function card(item: Item): HTMLElement {
  const shown = item.value === null ? null : valueAndInterval(item.value, item.low, item.high, item.unit);
  const symbol = item.symbol !== null && item.symbol !== "" && !item.label.includes(item.symbol);
  const value = el(
    "dd",
    { class: "value" },
    symbol && el("span", { class: "equals" }, ...rich(item.symbol ?? ""), " = "),
    el("b", {}, shown === null ? "not known" : shown.value),
    shown !== null && shown.unit !== "" && ` ${shown.unit}`,
  );
  const confidence = item.confidence === null ? "" : `${percent(item.confidence)}: `;
  const unit = shown === null || shown.unit === "" ? "" : ` ${shown.unit}`;
  return el(
    "div",
    { class: "number", "data-value": item.value },
    el("dt", {}, ...rich(item.label)),
    value,
    shown !== null &&
      shown.interval !== null &&
      el("dd", { class: "interval" }, `${confidence}${shown.interval}${unit}`),
    item.note !== null && item.note !== "" && el("dd", { class: "remark" }, ...rich(item.note)),
  );
}
