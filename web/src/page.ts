/** What a page holds, version 1: the checks are the types. */

import { numbers } from "./arrays";
import {
  type Check,
  type Checked,
  PageError,
  anything,
  flag,
  list,
  nullable,
  number,
  object,
  oneOf,
  plainObject,
  record,
  text,
  withDefault,
} from "./check";
import type { Square } from "./polyomino";

const FORMAT = "driftwalk page";
const VERSION = 1;

const pair: Check<[number, number]> = (value, where) => {
  const ends = list(number)(value, where);
  if (ends.length !== 2) throw new PageError(`'${where}' has ${ends.length} numbers, expected 2`);
  return ends as [number, number];
};

/**
 * The sketch of an outcome class: lower left corners of its squares, y upwards, in sides of a block. A third number, 1,
 * makes a disc of it.
 */
const square: Check<Square> = (value, where) => {
  const numbers = list(number)(value, where);
  if (numbers.length !== 2 && numbers.length !== 3) {
    throw new PageError(`'${where}' has ${numbers.length} numbers, expected 2 or 3`);
  }
  return numbers as unknown as Square;
};
const squares = list(square);

const arena = object({
  shape: oneOf("circle", "rectangle", "polygon"),
  diameter_m: nullable(number),
  width_m: nullable(number),
  height_m: nullable(number),
  vertices_m: nullable(list(pair)),
  center_m: nullable(pair),
});

const axis = object({ name: text, label: text, unit: text, values: list(number) });
const point = object({ x: number, y: number });

const base = { id: text, kind: text, title: text, note: nullable(text) };

const summary = object({
  ...base,
  paragraphs: list(text),
  numbers: list(
    object({
      label: text,
      symbol: nullable(text),
      value: nullable(number),
      unit: withDefault(text, "1"),
      low: nullable(number),
      high: nullable(number),
      confidence: nullable(number),
      note: nullable(text),
    }),
  ),
});

const warnings = object({ ...base, items: list(text) });

const trajectory = object({
  ...base,
  arena: nullable(arena),
  time: numbers,
  x: numbers,
  y: numbers,
  theta: nullable(numbers),
  gaps: withDefault(list(pair), []),
  speed: nullable(object({ edges: list(number), density: list(nullable(number)) })),
  facts: withDefault(
    list(
      object({
        label: text,
        value: anything,
        unit: nullable(text),
        low: nullable(number),
        high: nullable(number),
        note: nullable(text),
      }),
    ),
    [],
  ),
});

const flow = object({
  ...base,
  arena: nullable(arena),
  x: numbers,
  y: numbers,
  u: numbers,
  v: numbers,
  // 0 measured, 1 filled, 2 outside of the tank.
  origin: numbers,
  count: nullable(numbers),
  standard_error: nullable(numbers),
});

const mapCells = object({
  excerpt_time: nullable(numbers),
  excerpt_x: nullable(numbers),
  excerpt_y: nullable(numbers),
  density: nullable(numbers),
  ks_step_length: nullable(numbers),
  ks_turning_angle: nullable(numbers),
});

const map = object({
  ...base,
  x: axis,
  y: axis,
  value: numbers,
  standard_error: nullable(numbers),
  status: nullable(numbers),
  statuses: withDefault(record(text), new Map<string, string>()),
  best: nullable(object({ x: number, y: number, value: nullable(number) })),
  found: nullable(point),
  noise_floor: nullable(number),
  noise_floor_upper: nullable(number),
  region: nullable(object({ x: list(number), y: list(number), confidence: nullable(number) })),
  refined: nullable(object({ x: list(number), y: list(number), value: numbers })),
  cells: nullable(mapCells),
  recording: nullable(
    object({
      density: numbers,
      step_length_edges: list(number),
      turning_angle_edges: list(number),
      excerpt_x: nullable(numbers),
      excerpt_y: nullable(numbers),
    }),
  ),
  arena: nullable(arena),
});

const quantity = object({ label: text, unit: nullable(text), log: nullable(flag) });

const lines = object({
  ...base,
  x: quantity,
  y: quantity,
  series: list(
    object({
      name: text,
      x: numbers,
      y: numbers,
      low: nullable(numbers),
      high: nullable(numbers),
      style: withDefault(oneOf("line", "points", "step"), "line"),
    }),
  ),
  marks: withDefault(list(object({ x: nullable(number), y: nullable(number), label: text })), []),
});

const imageGrid = object({
  ...base,
  arena: nullable(arena),
  x: axis,
  y: axis,
  value: numbers,
  label: text,
  unit: nullable(text),
  diverging: withDefault(flag, false),
  limits: nullable(pair),
});

const classes = object({
  ...base,
  confidence: nullable(number),
  runs: nullable(number),
  series: list(
    object({
      name: text,
      items: list(
        object({
          class: text,
          cells: withDefault(squares, []),
          count: nullable(number),
          share: nullable(number),
          low: nullable(number),
          high: nullable(number),
          note: nullable(text),
        }),
      ),
    }),
  ),
});

const classTimes = object({
  ...base,
  time: numbers,
  classes: list(
    object({
      class: text,
      cells: withDefault(squares, []),
      share: numbers,
      low: nullable(numbers),
      high: nullable(numbers),
    }),
  ),
});

/** Classes of the settings of a map over time; a live page asks for those of one setting at a time. */
const overTime = object({
  time: numbers,
  classes: list(text),
  cells: withDefault(list(squares), []),
  count: numbers,
  runs: numbers,
  reference: nullable(numbers),
});

const l1Map = object({
  ...base,
  x: axis,
  y: axis,
  value: numbers,
  reference: nullable(point),
  noise: nullable(number),
  label: text,
  classes: withDefault(list(text), []),
  cells: withDefault(list(squares), []),
  shares: nullable(numbers),
  over_time: nullable(overTime),
});

const settingTimes = object({ ...base, settings: list(text), over_time: overTime });

const biplot = object({
  ...base,
  axes: list(object({ label: text, share: nullable(number) })),
  points: object({
    x: numbers,
    y: numbers,
    names: list(text),
    values: nullable(record(numbers)),
  }),
  arrows: list(object({ name: text, x: number, y: number, cells: withDefault(squares, []) })),
});

const classGraph = object({
  ...base,
  height: number,
  classes: list(object({ class: text, cells: squares, x: number, y: number })),
  arrows: list(object({ x: pair, y: pair, at: number, share: number, label: text })),
});

const replay = object({
  ...base,
  arena: nullable(arena),
  side: number,
  width: nullable(number),
  time: numbers,
  runs: list(
    object({
      name: text,
      x: numbers,
      y: numbers,
      theta: numbers,
      assembly: numbers,
      events: withDefault(list(object({ time: number, blocks: list(number), class: nullable(text) })), []),
      classes: withDefault(list(object({ time: number, class: text })), []),
    }),
  ),
  cells: withDefault(record(squares), new Map<string, Square[]>()),
});

const table = object({ ...base, columns: list(text), rows: list(list(anything)) });

const manifest = object({
  ...base,
  command: nullable(text),
  entries: anything,
  inputs: withDefault(list(object({ role: text, name: text, sha256: nullable(text) })), []),
  cite: nullable(text),
  bibtex: nullable(text),
});

const empty = object({ ...base, reason: text });

const controls = object({
  ...base,
  items: list(
    object({
      name: text,
      label: text,
      unit: nullable(text),
      kind: oneOf("range", "choice", "toggle"),
      min: nullable(number),
      max: nullable(number),
      step: nullable(number),
      value: anything,
      log: withDefault(flag, false),
      choices: withDefault(list(anything), []),
      note: nullable(text),
    }),
  ),
});

const arrows = object({ x: numbers, y: numbers, u: numbers, v: numbers });
/** The tank of the playground. */
const tank = object({
  ...base,
  arena: nullable(arena),
  side: number,
  width: nullable(number),
  flow: nullable(arrows),
  /** Bodies without a shape of their own are dots. */
  shape: withDefault(text, "square"),
  /** How far back the trails go [s]; 0 for none. */
  trail_s: withDefault(number, 0),
});

export { tank as checkTank, controls as checkControls, overTime as checkOverTime };
export type Arena = Checked<typeof arena>;
export type SummarySection = Checked<typeof summary>;
export type WarningsSection = Checked<typeof warnings>;
export type TrajectorySection = Checked<typeof trajectory>;
export type FlowSection = Checked<typeof flow>;
export type MapSection = Checked<typeof map>;
export type LinesSection = Checked<typeof lines>;
export type ImageGridSection = Checked<typeof imageGrid>;
export type ClassesSection = Checked<typeof classes>;
export type ClassTimesSection = Checked<typeof classTimes>;
export type OverTime = Checked<typeof overTime>;
export type L1MapSection = Checked<typeof l1Map>;
export type SettingTimesSection = Checked<typeof settingTimes>;
export type BiplotSection = Checked<typeof biplot>;
export type ClassGraphSection = Checked<typeof classGraph>;
export type ReplaySection = Checked<typeof replay>;
export type TableSection = Checked<typeof table>;
export type ManifestSection = Checked<typeof manifest>;
export type EmptySection = Checked<typeof empty>;
export type ControlsSection = Checked<typeof controls>;

/** The check of every kind of section. */
export const SECTIONS = {
  summary,
  warnings,
  trajectory,
  flow,
  map,
  lines,
  image_grid: imageGrid,
  classes,
  class_times: classTimes,
  l1_map: l1Map,
  setting_times: settingTimes,
  biplot,
  class_graph: classGraph,
  replay,
  table,
  manifest,
  empty,
} as const;

export type Kind = keyof typeof SECTIONS;
export type SectionOf<K extends Kind> = Checked<(typeof SECTIONS)[K]>;

export { arena as checkArena };

const state = object({
  finished: withDefault(flag, true),
  progress: nullable(number),
  words: nullable(text),
});
export type State = Checked<typeof state>;
export const checkState = (value: unknown): State => state(value, "state");

/** A section whose head is checked; the rest is checked by its kind when it is drawn. */
export interface RawSection {
  readonly id: string;
  readonly kind: string;
  readonly title: string;
  readonly note: string | null;
  /** The heading that it is folded under, and the run that it belongs to; null where there is none. */
  readonly chapter: string | null;
  readonly run: string | null;
  readonly content: unknown;
}

const head = object({ ...base, chapter: nullable(text), run: nullable(text) });
export function checkSectionHead(value: unknown, where: string): RawSection {
  return { ...head(value, where), content: value };
}

const page = object({
  format: text,
  version: number,
  view: oneOf("report", "run", "live", "play"),
  title: text,
  subtitle: nullable(text),
  state: nullable(state),
  driftwalk_version: nullable(text),
  created_utc: nullable(text),
  sections: withDefault(list(checkSectionHead), []),
});
export type Page = Checked<typeof page>;

/** Returns the page when it is one, else throws a `PageError` that says what is wrong where. */
export function checkPage(value: unknown): Page {
  const given = plainObject(value, "");
  if (given["format"] !== FORMAT) {
    throw new PageError("this is no page of driftwalk: make the report again");
  }
  if (given["version"] !== VERSION) {
    throw new PageError(
      `this page has version ${String(given["version"])}, and this program reads version ${VERSION}: ` +
        "open it with the version of driftwalk that wrote it",
    );
  }
  return page(value, "");
}
