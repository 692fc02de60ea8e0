/** Small parts that several sections share: legends, readouts, tables, facts. */

import { type Child, el, svg } from "./dom";
import { rich } from "./symbols";

export type Swatch =
  "line" | "dash" | "band" | "solid" | "dot" | "hatch" | "cross" | "star" | "ring" | "diamond" | "box";

/** Returns a legend; the colour of a swatch is a colour or a variable of the style sheet. */
export function legend(
  items: readonly { readonly swatch: Swatch; readonly colour?: string; readonly text: string }[],
): HTMLElement {
  const list = el("ul", { class: "legend" });
  for (const item of items) {
    const picture = swatch(item.swatch);
    if (item.colour !== undefined) picture.style.setProperty("color", item.colour);
    list.append(el("li", {}, picture, el("span", {}, ...rich(item.text))));
  }
  return list;
}

function swatch(kind: Swatch): SVGSVGElement {
  const picture = svg("svg", {
    class: `swatch ${kind}`,
    viewBox: "0 0 18 12",
    width: 18,
    height: 12,
    "aria-hidden": "true",
  });
  picture.append(...SHAPES[kind]());
  return picture;
}

const SHAPES: Readonly<Record<Swatch, () => SVGElement[]>> = {
  line: () => [svg("path", { d: "M1 6H17", class: "stroke" })],
  dash: () => [svg("path", { d: "M1 6H17", class: "stroke", "stroke-dasharray": "4 3" })],
  band: () => [svg("rect", { x: 1, y: 1, width: 16, height: 10, class: "fill faint" })],
  solid: () => [svg("rect", { x: 1, y: 1, width: 16, height: 10, class: "fill" })],
  dot: () => [svg("circle", { cx: 9, cy: 6, r: 4, class: "fill" })],
  hatch: () => [
    svg("rect", { x: 1.5, y: 1.5, width: 15, height: 9, class: "outline" }),
    svg("path", { d: "M2 10L8 2M7 10L13 2M12 10L16 4", class: "thin" }),
  ],
  cross: () => [svg("path", { d: "M5 2L13 10M13 2L5 10", class: "stroke" })],
  star: () => [svg("path", { d: starPath(9, 6, 5.5), class: "fill" })],
  ring: () => [svg("circle", { cx: 9, cy: 6, r: 4, class: "stroke" })],
  diamond: () => [svg("path", { d: "M9 1L14 6L9 11L4 6Z", class: "fill" })],
  box: () => [svg("rect", { x: 2, y: 1.5, width: 14, height: 9, class: "stroke" })],
};

/** Returns the data of a five-pointed star. */
export function starPath(x: number, y: number, radius: number): string {
  const points = Array.from({ length: 10 }, (_, index) => {
    const reach = index % 2 === 0 ? radius : 0.42 * radius;
    const angle = (Math.PI * index) / 5 - Math.PI / 2;
    return `${(x + reach * Math.cos(angle)).toFixed(1)} ${(y + reach * Math.sin(angle)).toFixed(1)}`;
  });
  return `M${points.join("L")}Z`;
}

/** A line under a figure that says what the pointer is on. */
export interface Readout {
  readonly element: HTMLElement;
  show(parts: readonly (readonly [label: string, value: string])[] | null): void;
}

export function readout(hint: string): Readout {
  const element = el("p", { class: "readout" });
  // A finger taps, and cannot point.
  const words = matchMedia("(hover: none)").matches ? hint.replace(/^Point at/, "Tap") : hint;
  const show: Readout["show"] = (parts) => {
    if (parts === null) {
      element.replaceChildren(el("span", { class: "hint" }, words));
      return;
    }
    element.replaceChildren(
      ...parts.map(([label, value]) =>
        el("span", { class: "pair" }, el("span", { class: "name" }, ...rich(label)), " ", el("b", {}, value)),
      ),
    );
  };
  show(null);
  return { element, show };
}

/** Returns a list of facts: label and value. */
export function facts(
  items: readonly (readonly [label: string, value: string, note?: string | null])[],
): HTMLElement {
  const list = el("dl", { class: "facts" });
  for (const [label, value, note] of items) {
    const remark = note !== undefined && note !== null && note !== "" && el("small", {}, note);
    list.append(el("div", {}, el("dt", {}, ...rich(label)), el("dd", {}, value, remark)));
  }
  return list;
}

/** Returns a table; `numeric` columns are set to the right. */
export function table(
  caption: string,
  columns: readonly Child[],
  rows: readonly (readonly string[])[],
  numeric: (column: number) => boolean,
): HTMLElement {
  const head = el(
    "tr",
    {},
    ...columns.map((name, index) =>
      el("th", { scope: "col", class: numeric(index) ? "number" : null }, name),
    ),
  );
  // On a phone each row of a wide table is a block, and each cell names its column.
  const labels = columns.map((name) => (name instanceof Node ? name.textContent : name || ""));
  const body = rows.map((row) =>
    el(
      "tr",
      {},
      ...row.map((value, index) =>
        el("td", { class: numeric(index) ? "number" : null, "data-column": labels[index] }, ...rich(value)),
      ),
    ),
  );
  return el(
    "div",
    { class: columns.length > 3 ? "table many" : "table", tabindex: 0, role: "region", "aria-label": caption },
    el(
      "table",
      {},
      el("caption", { class: "unseen" }, caption),
      el("thead", {}, head),
      el("tbody", {}, ...body),
    ),
  );
}

/** Returns details whose content is made when they are opened for the first time. */
export function details(title: string, make: () => Node): HTMLDetailsElement {
  const element = el("details", { class: "more" }, el("summary", {}, title));
  element.addEventListener("toggle", () => {
    if (element.open && element.childElementCount === 1) element.append(make());
  });
  return element;
}

/** Returns a row of buttons of which one is pressed. */
export function choices<T extends string>(
  label: string,
  options: readonly (readonly [value: T, text: string])[],
  chosen: T,
  changed: (value: T) => void,
): HTMLElement {
  const group = el("div", { class: "choices", role: "group", "aria-label": label });
  for (const [value, text] of options) {
    const button = el(
      "button",
      { type: "button", "aria-pressed": String(value === chosen), "data-choice": value },
      text,
    );
    button.addEventListener("click", () => {
      for (const other of group.children) other.setAttribute("aria-pressed", String(other === button));
      changed(value);
    });
    group.append(button);
  }
  return group;
}
