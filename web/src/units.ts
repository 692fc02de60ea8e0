/** Values in the units that a reader expects (cm, mm, mN, degrees), and numbers as text. */

/** A unit in which values are shown: shown = stored × factor. */
export interface Display {
  readonly factor: number;
  /** Empty for plain numbers. */
  readonly unit: string;
}

const DEGREES = 180 / Math.PI;

/** From the largest magnitude [stored unit] up, which unit is used; the last one for all below. */
const LADDERS: Readonly<Record<string, readonly (readonly [number, number, string])[]>> = {
  m: [
    [2, 1, "m"],
    [0.02, 1e2, "cm"],
    [1e-4, 1e3, "mm"],
    [0, 1e6, "µm"],
  ],
  N: [
    [0.1, 1, "N"],
    [1e-5, 1e3, "mN"],
    [0, 1e6, "µN"],
  ],
  s: [
    [0.1, 1, "s"],
    [1e-4, 1e3, "ms"],
    [0, 1e6, "µs"],
  ],
  kg: [
    [0.5, 1, "kg"],
    [0, 1e3, "g"],
  ],
  "m/s": [
    [1, 1, "m/s"],
    [2e-3, 1e2, "cm/s"],
    [0, 1e3, "mm/s"],
  ],
  rad: [[0, DEGREES, "°"]],
  "rad/s": [[0, DEGREES, "°/s"]],
  // Densities, beside lengths in mm and angles in degrees.
  "1/m": [
    [20, 1e-3, "1/mm"],
    [0, 1, "1/m"],
  ],
  "1/rad": [[0, 1 / DEGREES, "1/°"]],
};

const SAME: Readonly<Record<string, string>> = {
  "m s-1": "m/s",
  "m s^-1": "m/s",
  "rad s-1": "rad/s",
  "m-1": "1/m",
  "rad-1": "1/rad",
};

/** Returns the unit in which values up to a magnitude are shown. */
export function displayOf(unit: string | null, magnitude: number): Display {
  const stored = unit === null ? "" : (SAME[unit] ?? unit);
  if (stored === "1" || stored === "") return { factor: 1, unit: "" };
  const ladder = LADDERS[stored];
  if (ladder === undefined) return { factor: 1, unit: prettyUnit(stored) };
  // Rounding must not move a value such as 0.0999999 into a smaller unit.
  const step = ladder.find(([from]) => Math.abs(magnitude) * (1 + 1e-9) >= from) ?? ladder.at(-1);
  return step === undefined ? { factor: 1, unit: stored } : { factor: step[1], unit: step[2] };
}

/** Returns the unit for a list of values. */
export function displayFor(unit: string | null, values: Iterable<number>): Display {
  let magnitude = 0;
  for (const value of values) {
    if (Number.isFinite(value)) magnitude = Math.max(magnitude, Math.abs(value));
  }
  return displayOf(unit, magnitude === 0 ? 1 : magnitude);
}

/** Returns "label (unit)", the unit before what a comma adds, or the label alone. */
export function labelled(label: string, display: Display): string {
  if (display.unit === "") return label;
  const comma = label.indexOf(", ");
  if (comma < 0) return `${label} (${display.unit})`;
  return `${label.slice(0, comma)} (${display.unit})${label.slice(comma)}`;
}

/** Returns a number with so many significant digits, a real minus and no useless zeros. */
export function short(value: number, digits = 3): string {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return scientific(value, digits);
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return minus(String(Number(value.toFixed(Math.min(decimals, 12)))));
}

/** Returns a number with a fixed number of decimals. */
export function fixed(value: number, decimals: number): string {
  return Number.isFinite(value) ? minus(value.toFixed(Math.min(Math.max(decimals, 0), 12))) : "–";
}

/** Returns how many decimals show a step or an uncertainty with so many digits. */
export function decimalsFor(step: number, digits = 1): number {
  if (!(step > 0) || !Number.isFinite(step)) return 3;
  return Math.max(0, digits - 1 - Math.floor(Math.log10(step) + 1e-9));
}

/** Returns how many decimals write a round step in full: 1 for 0.5, 2 for 0.25. */
export function stepDecimals(step: number): number {
  const decimals = decimalsFor(step);
  const scaled = step * 10 ** decimals;
  return Math.abs(scaled - Math.round(scaled)) > 1e-6 ? decimals + 1 : decimals;
}

/** Returns a whole number with thin spaces between its thousands. */
export function whole(value: number): string {
  const digits = String(Math.abs(Math.round(value)));
  const grouped = digits.length < 5 ? digits : digits.replace(/(?<=\d)(?=(\d{3})+$)/g, "\u202f");
  return value < 0 ? `−${grouped}` : grouped;
}

/** Returns a value with its unit, in the unit a reader expects. */
export function quantity(value: number, unit: string | null, digits = 3): string {
  const display = displayOf(unit, value === 0 ? 1 : value);
  return inUnit(value, display, digits);
}

/** Returns a value in a unit that is chosen already. */
export function inUnit(value: number, display: Display, digits = 3): string {
  const number = short(value * display.factor, digits);
  if (display.unit === "" || !Number.isFinite(value)) return number;
  return display.unit === "°" ? `${number}°` : `${number} ${display.unit}`;
}

/** Returns "0.38" and "0.37 to 0.40": as many decimals as the interval deserves. */
export function valueAndInterval(
  value: number,
  low: number | null,
  high: number | null,
  unit: string | null,
): { value: string; interval: string | null; unit: string } {
  const display = displayOf(unit, value === 0 ? (high ?? 1) : value);
  if (low === null || high === null || !(high > low)) {
    const count = display.unit === "" && Number.isInteger(value);
    const written = count ? whole(value) : short(value * display.factor);
    return { value: written, interval: null, unit: display.unit };
  }
  const width = (high - low) * display.factor;
  const decimals = decimalsFor(width, 2);
  const large = Math.max(Math.abs(low), Math.abs(high)) * display.factor;
  const written = (shown: number): string =>
    large < 1e-4 || large >= 1e6 ? short(shown, 3) : fixed(shown, decimals);
  return {
    value: written(value * display.factor),
    interval: `${written(low * display.factor)} to ${written(high * display.factor)}`,
    unit: display.unit,
  };
}

/** Returns "95 %" for 0.95. */
export function percent(share: number, digits = 3): string {
  return Number.isFinite(share) ? `${short(100 * share, digits)} %` : "–";
}

/** Returns a duration as "1 h 5 min", "2 min 5 s" or "3.2 s". */
export function duration(seconds: number): string {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds < 120) return `${short(seconds)} s`;
  const minutes = Math.floor(seconds / 60);
  if (minutes < 120) {
    const rest = Math.round(seconds - 60 * minutes);
    return rest === 0 ? `${minutes} min` : `${minutes} min ${rest} s`;
  }
  const rest = minutes % 60;
  return rest === 0 ? `${Math.floor(minutes / 60)} h` : `${Math.floor(minutes / 60)} h ${rest} min`;
}

function scientific(value: number, digits: number): string {
  const [mantissa = "", exponent = ""] = value.toExponential(digits - 1).split("e");
  return `${minus(String(Number(mantissa)))}×10${superscript(String(Number(exponent)))}`;
}

function superscript(text: string): string {
  return text.replace(/[-0-9]/g, (letter) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(letter)] ?? letter);
}

/** Returns "N² s" for "N2 s" and "m s⁻¹" for "m s-1". */
export function prettyUnit(unit: string): string {
  return unit.replace(/(?<=[A-Za-z])\^?(-?\d+)/g, (_, power: string) => superscript(power));
}

function minus(text: string): string {
  return text.replace("-", "−");
}
