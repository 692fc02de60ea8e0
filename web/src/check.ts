/** Small checks of plain JSON that give both a type and an error that says where it is wrong. */

/** What is wrong with a page, in words for its reader. */
export class PageError extends Error {}

export type Check<T> = (value: unknown, where: string) => T;
export type Checked<C> = C extends Check<infer T> ? T : never;

export const number: Check<number> = (value, where) => {
  if (typeof value !== "number" || !Number.isFinite(value)) throw wrong(where, "a number", value);
  return value;
};

export const text: Check<string> = (value, where) => {
  if (typeof value !== "string") throw wrong(where, "text", value);
  return value;
};

export const flag: Check<boolean> = (value, where) => {
  if (typeof value !== "boolean") throw wrong(where, "true or false", value);
  return value;
};

/** Anything at all: what is shown as it is, such as the entries of a manifest. */
export const anything: Check<unknown> = (value) => value;

/** A key that may be null or absent. */
export function nullable<T>(check: Check<T>): Check<T | null> {
  return (value, where) => (value === null || value === undefined ? null : check(value, where));
}

/** A key that may be absent and then has a fixed value. */
export function withDefault<T>(check: Check<T>, otherwise: T): Check<T> {
  return (value, where) => (value === null || value === undefined ? otherwise : check(value, where));
}

export function list<T>(check: Check<T>): Check<T[]> {
  return (value, where) => {
    if (!Array.isArray(value)) throw wrong(where, "a list", value);
    return value.map((item, index) => check(item, `${where}[${index}]`));
  };
}

export function record<T>(check: Check<T>): Check<Map<string, T>> {
  return (value, where) => {
    const entries = Object.entries(plainObject(value, where));
    return new Map(entries.map(([key, item]) => [key, check(item, `${where}.${key}`)]));
  };
}

export function oneOf<T extends string>(...allowed: readonly T[]): Check<T> {
  return (value, where) => {
    const found = allowed.find((item) => item === value);
    if (found === undefined) throw wrong(where, `one of ${allowed.join(", ")}`, value);
    return found;
  };
}

export function object<S extends Record<string, Check<unknown>>>(
  shape: S,
): Check<{ [K in keyof S]: Checked<S[K]> }> {
  return (value, where) => {
    const given = plainObject(value, where);
    const checked: Record<string, unknown> = {};
    for (const [key, check] of Object.entries(shape)) {
      checked[key] = check(given[key], where === "" ? key : `${where}.${key}`);
    }
    return checked as { [K in keyof S]: Checked<S[K]> };
  };
}

/** Returns `value` as an object with unknown values, or throws. */
export function plainObject(value: unknown, where: string): Record<string, unknown> {
  if (typeof value !== "object" || value === null || Array.isArray(value)) {
    throw wrong(where, "an object", value);
  }
  return value as Record<string, unknown>;
}

function wrong(where: string, expected: string, value: unknown): PageError {
  return new PageError(`${where === "" ? "the page" : `'${where}'`} is not ${expected}: got ${brief(value)}`);
}

function brief(value: unknown): string {
  if (value === undefined) return "nothing";
  const written = JSON.stringify(value) ?? String(value);
  return written.length > 60 ? `${written.slice(0, 57)}...` : written;
}
