/** The knobs of the playground. */

import { el } from "../dom";
import type { ControlsSection } from "../page";
import { choices } from "../parts";
import { rich, spoken } from "../symbols";
import { displayOf, inUnit, short } from "../units";

type Item = ControlsSection["items"][number];

export interface Knobs {
  readonly element: HTMLElement;
  /** Shows what holds now; a knob under the reader's hand stays as it is. */
  update(section: ControlsSection): void;
}

interface Knob {
  readonly element: HTMLElement;
  set(value: unknown): void;
}

export function makeKnobs(section: ControlsSection, changed: (name: string, value: unknown) => void): Knobs {
  const knobs = new Map(section.items.map((item) => [item.name, makeKnob(item, changed)]));
  const element = el("div", { class: "knobs" }, ...[...knobs.values()].map((knob) => knob.element));
  return {
    element,
    update: (now) => {
      for (const item of now.items) {
        const knob = knobs.get(item.name);
        if (knob !== undefined && knob.element.dataset["held"] !== "yes") knob.set(item.value);
      }
    },
  };
}

function makeKnob(item: Item, changed: (name: string, value: unknown) => void): Knob {
  switch (item.kind) {
    case "range":
      return rangeKnob(item, changed);
    case "choice":
      return choiceKnob(item, changed);
    case "toggle":
      return toggleKnob(item, changed);
  }
}

/** How a value lies on a slider: the slider's own places are whole steps. */
export interface SliderScale {
  readonly steps: number;
  place(value: number): number;
  value(place: number): number;
}

const LOG_STEPS = 400;

export function sliderScale(low: number, high: number, step: number, log: boolean): SliderScale {
  if (log && low > 0) {
    const decades = Math.log(high / low);
    return {
      steps: LOG_STEPS,
      place: (value) => Math.round((LOG_STEPS * Math.log(value / low)) / decades),
      value: (place) => {
        const exact = low * Math.exp((decades * place) / LOG_STEPS);
        return Math.min(high, Math.max(low, Number(exact.toPrecision(3))));
      },
    };
  }
  const size = step > 0 ? step : (high - low) / 100;
  return {
    steps: Math.round((high - low) / size),
    place: (value) => Math.round((value - low) / size),
    // Steps such as 0.01 add up with a rounding error that nobody wants to read.
    value: (place) => Math.min(high, Number((low + place * size).toPrecision(12))),
  };
}

function rangeKnob(item: Item, changed: (name: string, value: unknown) => void): Knob {
  const [low, high] = [item.min ?? 0, item.max ?? 1];
  const scale = sliderScale(low, high, item.step ?? 0, item.log);
  const input = el("input", {
    type: "range",
    min: 0,
    max: scale.steps,
    step: 1,
    name: item.name,
    "aria-label": spoken(item.label),
  });
  const shown = el("output", { class: "knob-value" });
  const show = (value: number): void => {
    shown.textContent = written(value, item);
    input.setAttribute("aria-valuetext", written(value, item));
  };
  input.addEventListener("input", () => {
    const value = scale.value(Number(input.value));
    show(value);
    changed(item.name, value);
  });
  const element = el(
    "label",
    { class: "knob" },
    el("span", { class: "knob-label" }, ...rich(item.label)),
    shown,
    input,
  );
  holdWhilePressed(element, input);
  const set = (value: unknown): void => {
    if (typeof value !== "number") return;
    input.value = String(scale.place(value));
    show(value);
  };
  set(item.value);
  return { element, set };
}

function written(value: number, item: Item): string {
  if (item.unit === "×") return `${short(value)} ×`;
  // Over many decades one unit would write most values as 0.000…
  return inUnit(value, displayOf(item.unit, item.log ? value : (item.max ?? value)));
}

function holdWhilePressed(element: HTMLElement, input: HTMLInputElement): void {
  input.addEventListener("pointerdown", () => {
    element.dataset["held"] = "yes";
  });
  for (const name of ["pointerup", "pointercancel"] as const) {
    input.addEventListener(name, () => {
      delete element.dataset["held"];
    });
  }
}

function choiceKnob(item: Item, changed: (name: string, value: unknown) => void): Knob {
  const options = item.choices.map((choice): [string, string] => [
    String(choice),
    String(choice).replaceAll("_", " "),
  ]);
  const group = choices(spoken(item.label), options, String(item.value), (value) => {
    changed(
      item.name,
      item.choices.find((choice) => String(choice) === value),
    );
  });
  const element = el(
    "div",
    { class: "knob" },
    el("span", { class: "knob-label" }, ...rich(item.label)),
    group,
  );
  const set = (value: unknown): void => {
    for (const button of group.children) {
      button.setAttribute("aria-pressed", String(button.getAttribute("data-choice") === String(value)));
    }
  };
  group.dataset["name"] = item.name;
  return { element, set };
}

function toggleKnob(item: Item, changed: (name: string, value: unknown) => void): Knob {
  const input = el("input", { type: "checkbox", name: item.name });
  input.addEventListener("change", () => changed(item.name, input.checked));
  const element = el(
    "label",
    { class: "knob toggle" },
    input,
    el("span", { class: "knob-label" }, ...rich(item.label)),
  );
  const set = (value: unknown): void => {
    input.checked = value === true;
  };
  set(item.value);
  return { element, set };
}
