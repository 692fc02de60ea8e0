/** Colours: scales for magnitudes and signed values, and a palette for classes. */

import { svg } from "./dom";

export type Rgb = readonly [number, number, number];

/** Okabe and Ito's palette for colour-blind readers, without black and the pale yellow. */
export const PALETTE = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A4B9A"] as const;
const GREYS = ["#9a9a9a", "#6b6b6b", "#bdbdbd", "#4d4d4d", "#848484"] as const;
const OTHER = "#c9c9c9";

/** Equally spaced colours of a scale, as hexadecimal digits. */
function steps(digits: string): Rgb[] {
  return (digits.match(/.{6}/g) ?? []).map(rgb);
}

const VIRIDIS = steps(
  "44015448186a472d7b4240863b528b33638d2c728e26828e21918c1fa08828ae803fbc735ec96284d44baddc30d8e219fde725",
);
const MAGMA = steps(
  "0000040a08221d114736106b51127c6a1c818326819c2e7fb73779d0416fe75263f56b5cfc8961fea772fec488fde2a3fcfdbf",
);
const BLUES = steps(
  "ebf3fbe3eef9dce9f6d4e4f4cddff1c6dbefb9d6eaadd0e6a0cbe291c3de81badb71b1d763a8d356a0ce4997c93d8dc43383be",
);
const NIGHT_BLUES = steps("1d2733223345273f56294c682b5979306788397699468aab5a9fbe74b4d093c8e0");
const BLUE_ORANGE = steps("0b559f3d82bd7fb0d6bdd6e8f1f0eef6d2b0eda66cd8742fb34a06");
const NIGHT_BLUE_ORANGE = steps("6db6ec4b8fc3356995294763262a2f5e40288d5a29c0772ef0974a");

export type Palette = "score" | "distance" | "magnitude" | "density" | "speed" | "signed";

/** Maps values to colours; its bar shows `ticks` at `position`. */
export interface ColourScale {
  readonly low: number;
  readonly high: number;
  /** Place of a value in the colour bar, 0 to 1; values beyond are moved to the ends. */
  position(value: number): number;
  /** Colour at a place of the colour bar. */
  at(position: number): Rgb;
  /** Colour of a value, null for what is not a number. */
  of(value: number): Rgb | null;
}

/** Returns the scale from `low` to `high`; `power` 0.5 makes the tails of a density visible. */
export function colourScale(
  palette: Palette,
  low: number,
  high: number,
  options: { dark?: boolean; power?: number } = {},
): ColourScale {
  const colours = coloursOf(palette, options.dark ?? false);
  const power = options.power ?? 1;
  const span = high > low ? high - low : 1;
  const position = (value: number): number => Math.min(1, Math.max(0, (value - low) / span)) ** power;
  const at = (place: number): Rgb => between(colours, place);
  return {
    low,
    high,
    position,
    at,
    of: (value) => (Number.isFinite(value) ? at(position(value)) : null),
  };
}

function coloursOf(palette: Palette, dark: boolean): Rgb[] {
  switch (palette) {
    case "score":
      return VIRIDIS;
    case "distance":
      // Near is bright, as a high score is.
      return [...VIRIDIS].reverse();
    case "density":
      // Dense is far from the background: dark on light, light on dark.
      return dark ? MAGMA.slice(2) : [...MAGMA].reverse();
    case "magnitude":
    case "speed":
      return dark ? NIGHT_BLUES : BLUES;
    case "signed":
      return dark ? NIGHT_BLUE_ORANGE : BLUE_ORANGE;
  }
}

/** Returns "rgb(…)". */
export function css(colour: Rgb): string {
  return `rgb(${colour.map((part) => Math.round(part)).join(",")})`;
}

export function rgb(hex: string): Rgb {
  const value = Number.parseInt(hex.replace("#", ""), 16);
  return [(value >> 16) & 255, (value >> 8) & 255, value & 255];
}

/** Returns whether all blocks of an outcome class are in one assembly. */
export function isComplete(name: string): boolean {
  return name !== "" && name !== "other" && !name.includes("+");
}

/** A colour for every class, the same on a whole page: hues for one assembly, greys for several. */
export class ClassColours {
  private readonly given = new Map<string, string>();
  private hues = 0;
  private greys = 0;

  of(name: string): string {
    const known = this.given.get(name);
    if (known !== undefined) return known;
    const colour = this.next(name);
    this.given.set(name, colour);
    return colour;
  }

  private next(name: string): string {
    if (name === "other") return OTHER;
    if (isComplete(name)) return PALETTE[this.hues++ % PALETTE.length] ?? OTHER;
    return GREYS[this.greys++ % GREYS.length] ?? OTHER;
  }
}

/** Returns the colour of one of several series. */
export function seriesColour(index: number): string {
  return PALETTE[index % PALETTE.length] ?? PALETTE[0];
}

/** Returns an SVG gradient from bottom to top of a scale. */
export function gradient(scale: ColourScale, id: string): SVGLinearGradientElement {
  const element = svg("linearGradient", { id, x1: 0, y1: 1, x2: 0, y2: 0 });
  for (let step = 0; step <= 24; step += 1) {
    const place = step / 24;
    element.append(svg("stop", { offset: place, "stop-color": css(scale.at(place)) }));
  }
  return element;
}

function between(colours: readonly Rgb[], place: number): Rgb {
  const along = Math.min(1, Math.max(0, place)) * (colours.length - 1);
  const index = Math.min(Math.floor(along), colours.length - 2);
  const from: Rgb = colours[index] ?? [0, 0, 0];
  const to: Rgb = colours[index + 1] ?? from;
  const share = along - index;
  const mixed = (part: 0 | 1 | 2): number => from[part] + share * (to[part] - from[part]);
  return [mixed(0), mixed(1), mixed(2)];
}
