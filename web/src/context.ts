/** What a section is drawn with, beside its own data. */

import type { Numbers } from "./arrays";
import { ClassColours } from "./colours";
import type { OverTime } from "./page";

/** What is kept of one setting of a map. */
export interface CellExcerpt {
  readonly time: Numbers | null;
  readonly x: Numbers | null;
  readonly y: Numbers | null;
  readonly density: Numbers | null;
  readonly ksStepLength: number | null;
  readonly ksTurningAngle: number | null;
  /** Its outcome classes, as of a map of one cell. */
  readonly overTime: OverTime | null;
}

export interface Context {
  /** What the reader has chosen, by section; it stays when the section is redrawn. */
  readonly memory: Map<string, unknown>;
  /** Asks the server for a cell that the page does not hold; null in a report. */
  readonly fetchCell: ((id: string, row: number, column: number) => Promise<CellExcerpt>) | null;
  /** Sends what the reader has set on a control; null where nobody listens. */
  readonly send: ((message: Readonly<Record<string, unknown>>) => void) | null;
}

/** Returns what was kept under a key, else what `make` gives, which is kept from now on. */
export function remembered<T>(context: Context, key: string, make: () => T): T {
  if (!context.memory.has(key)) context.memory.set(key, make());
  return context.memory.get(key) as T;
}

/** Returns the colours of the outcome classes, common to all sections of a page. */
export function classColours(context: Context): ClassColours {
  return remembered(context, "class colours", () => new ClassColours());
}
