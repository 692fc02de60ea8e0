/** The motion of the playground's blocks beside that of a recording. */

import { type Grid, decodeMaybe, numbers } from "../arrays";
import { type Bins, type DensityLook, densityLook, drawDensity } from "../charts/density";
import { type Figure, figure } from "../charts/responsive";
import { list, nullable, number, object, withDefault } from "../check";
import { el } from "../dom";
import { facts } from "../parts";
import { short, whole } from "../units";
import type { Message } from "./socket";

const densityMessage = object({
  simulated: nullable(numbers),
  recording: nullable(numbers),
  step_length_edges: list(number),
  turning_angle_edges: list(number),
  ks_distance: nullable(number),
  noise_floor: nullable(number),
  steps: withDefault(number, 0),
});

interface Shown {
  readonly simulated: Grid | null;
  readonly recording: Grid | null;
  readonly bins: Bins;
}

export class DensityPanel {
  private readonly words = el("div", { class: "density-words" });
  private readonly pictures: { readonly holder: HTMLElement; readonly drawn: Figure }[];
  private shown: Shown | null = null;

  constructor(
    private readonly root: HTMLElement,
    title: string,
    note: string | null,
  ) {
    const pair = el("div", { class: "pair-grid" });
    root.append(el("h2", {}, title), this.words, pair);
    if (note !== null && note !== "") root.append(el("p", { class: "note" }, note));
    this.pictures = [
      this.picture(pair, "In the tank", "simulated"),
      this.picture(pair, "Recording", "recording"),
    ];
    this.words.append(el("p", { class: "nothing" }, "Waiting for steps."));
  }

  async show(content: Message): Promise<void> {
    const message = densityMessage(content, "");
    const [simulated, recording] = await Promise.all([
      decodeMaybe(message.simulated),
      decodeMaybe(message.recording),
    ]);
    this.shown = {
      simulated,
      recording,
      bins: { length: message.step_length_edges, angle: message.turning_angle_edges },
    };
    for (const picture of this.pictures) picture.drawn.redraw();
    const [, second] = this.pictures;
    if (second !== undefined) second.holder.hidden = recording === null;
    const items: [string, string, string?][] = [["steps so far", whole(message.steps)]];
    if (recording !== null) {
      items.push(["KS distance D", message.ks_distance === null ? "–" : short(message.ks_distance)]);
      items.push(["noise floor", message.noise_floor === null ? "–" : short(message.noise_floor)]);
    }
    this.words.replaceChildren(facts(items));
    Object.assign(this.root.dataset, {
      steps: String(message.steps),
      ksDistance: message.ks_distance === null ? "" : String(message.ks_distance),
    });
  }

  private picture(
    parent: HTMLElement,
    title: string,
    which: "simulated" | "recording",
  ): { holder: HTMLElement; drawn: Figure } {
    const holder = el("div", {}, el("h4", {}, title));
    parent.append(holder);
    const drawn = figure(holder, "density", (width) => {
      const share = this.shown?.[which] ?? null;
      if (this.shown === null || share === null) return el("p", { class: "nothing" }, "no steps yet");
      const look = commonLook(this.shown);
      return drawDensity({ width, share, look, label: `${title}: density of step length and turning angle` });
    });
    return { holder, drawn };
  }
}

/** Returns axes that hold both motions, and the recording's colours: few steps make large densities. */
function commonLook({ simulated, recording, bins }: Shown): DensityLook {
  const known = [simulated, recording].filter((grid) => grid !== null);
  const look = densityLook(bins, known);
  return recording === null ? look : { ...look, top: densityLook(bins, [recording]).top };
}
