/** What was done, in a paragraph, and the numbers with their uncertainty. */

import { el } from "../dom";
import type { SummarySection } from "../page";
import { rich } from "../symbols";
import { details } from "../parts";
import { percent, valueAndInterval } from "../units";

/** How many numbers stand open: a row on a wide page. */
const MOST_NUMBERS = 4;
/** How many paragraphs stand open from the verdict on. */
const MOST_REASONS = 5;

type Item = SummarySection["numbers"][number];

export function drawSummary(section: SummarySection, body: HTMLElement): void {
  const words = section.paragraphs.map((text) => paragraph(text));
  const first = section.numbers.slice(0, MOST_NUMBERS);
  const others = section.numbers.slice(MOST_NUMBERS);
  // What was recorded, what came out, and then what is to be said of it.
  const begin = words.findIndex((one) => one.dataset["verdict"] !== undefined);
  body.append(...words.slice(0, begin < 0 ? words.length : begin));
  if (first.length > 0) body.append(el("dl", { class: "numbers" }, ...first.map(card)));
  if (begin >= 0) {
    const reasons = words.slice(begin);
    body.append(...reasons.slice(0, MOST_REASONS));
    const rest = reasons.slice(MOST_REASONS);
    if (rest.length > 0) body.append(details(`${rest.length} more remarks`, () => el("div", {}, ...rest)));
  }
  if (others.length > 0) {
    body.append(details("More numbers", () => el("dl", { class: "numbers" }, ...others.map(card))));
  }
}

/** Returns a paragraph; one with the verdict carries it, so that it can be seen. */
function paragraph(text: string): HTMLElement {
  const [, word, rest] = /^Verdict: (explains|does not explain|cannot tell|not checked)(.*)$/s.exec(text) ?? [];
  if (word === undefined) {
    return el("p", { class: "lead", "data-verdict": text.startsWith("Verdict: ") && "other" }, ...rich(text));
  }
  return el("p", { class: "lead verdict", "data-verdict": word }, "Verdict: ", el("b", {}, word), ...rich(rest ?? ""));
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
