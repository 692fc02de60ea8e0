/** The messages of a tracker's stream, checked. */

import { anything, flag, list, nullable, number, object, text, withDefault } from "../check";
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

export const checkHello = object({
  source: nullable(text),
  markers: nullable(text),
  tank: nullable(checkArena),
  block_side_m: nullable(number),
  body_count: nullable(number),
  observed: withDefault(flag, false),
  image: nullable(
    object({
      width_px: number,
      height_px: number,
      homography_px_to_m: list(number),
      lens: nullable(lens),
    }),
  ),
});
export type Hello = ReturnType<typeof checkHello>;

const body = object({
  id: text,
  seen: withDefault(flag, true),
  x_m: nullable(number),
  y_m: nullable(number),
  theta_rad: nullable(number),
  ambiguous: nullable(number),
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
  frames_lost_by_client: nullable(number),
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
