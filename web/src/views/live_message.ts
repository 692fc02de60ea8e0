/** The messages of a tracker's stream, checked. */

import { type Check, PageError, anything, flag, list, nullable, number, object, text, withDefault } from "../check";
import { checkArena } from "../page";
import type { Join } from "../tank/joined";

const lens = object({
  focal_x_px: number,
  focal_y_px: number,
  centre_column_px: number,
  centre_row_px: number,
  k1: withDefault(number, 0),
  k2: withDefault(number, 0),
  k3: withDefault(number, 0),
  p1: withDefault(number, 0),
  p2: withDefault(number, 0),
});

const HOMOGRAPHY_ENTRIES = 9;

const image = object({
  width_px: size,
  height_px: size,
  homography_px_to_m: homography,
  lens: nullable(lens),
});

const hello = object({
  source: nullable(text),
  tank: nullable(checkArena),
  block_side_m: nullable(number),
  block_width_m: nullable(number),
});
export type Hello = ReturnType<typeof hello> & {
  readonly image: ReturnType<typeof image> | null;
  /** Why there is no video although the tracker described one. */
  readonly imageFault: string | null;
};

/** A stream of whose tank and camera nothing is known. */
export const UNKNOWN: Hello = {
  source: null,
  tank: null,
  block_side_m: null,
  block_width_m: null,
  image: null,
  imageFault: null,
};

/** Checks the first message of a stream; an image that cannot be placed costs the video only. */
export const checkHello: Check<Hello> = (value, where) => {
  const found = hello(value, where);
  const given = (value as Record<string, unknown>)["image"];
  try {
    return { ...found, image: nullable(image)(given, "image"), imageFault: null };
  } catch (error) {
    if (!(error instanceof PageError)) throw error;
    return { ...found, image: null, imageFault: error.message };
  }
};

function size(value: unknown, where: string): number {
  const found = number(value, where);
  if (found <= 0) throw new PageError(`'${where}' is not above 0: got ${found}`);
  return found;
}

function homography(value: unknown, where: string): number[] {
  const found = list(number)(value, where);
  if (found.length === HOMOGRAPHY_ENTRIES) return found;
  throw new PageError(`'${where}' does not have ${HOMOGRAPHY_ENTRIES} numbers: got ${found.length}`);
}

const body = object({
  id: text,
  seen: withDefault(flag, true),
  x_m: nullable(number),
  y_m: nullable(number),
  theta_rad: nullable(number),
});

const event = object({
  time_s: number,
  kind: text,
  bodies: list(text),
  outcome: nullable(text),
});
export type LiveEvent = ReturnType<typeof event>;

const frame = object({
  frame: number,
  time_s: number,
  bodies: list(body),
  joined: nullable(list(list(anything))),
  outcome: nullable(text),
  possible: nullable(list(text)),
  hidden: nullable(list(text)),
  events: nullable(list(event)),
  latency_s: nullable(number),
  dropped_frames: nullable(number),
  jpeg_base64: nullable(text),
});
export type Frame = Omit<ReturnType<typeof frame>, "joined"> & { readonly joined: Join[] | null };

export function checkFrame(value: unknown): Frame {
  const found = frame(value, "");
  const joined =
    found.joined?.map(([one, face, other, otherFace]): Join => [
      String(one),
      Number(face),
      String(other),
      Number(otherFace),
    ]) ?? null;
  return { ...found, joined };
}
