/** The tank on a canvas: water, flow arrows, trails, blocks. For all pages on which it moves. */

import { at } from "../arrays";
import { PALETTE } from "../colours";
import { el } from "../dom";
import type { Arena } from "../page";
import { niceStep } from "../scale";
import { onThemeChange, styleColour } from "../theme";
import { quantity } from "../units";
import { type Box, boxAround, outline } from "./outline";

/** Arrows of the flow: places [m] and velocities [m/s]. */
export interface FlowArrows {
  readonly x: ArrayLike<number>;
  readonly y: ArrayLike<number>;
  readonly u: ArrayLike<number>;
  readonly v: ArrayLike<number>;
}

export interface Blocks {
  readonly x: ArrayLike<number>;
  readonly y: ArrayLike<number>;
  /** Not a number where the orientation is not known: such a block is drawn as a disc. */
  readonly theta: ArrayLike<number>;
  /** Fill of every block. */
  readonly colours: readonly string[];
  /** Outlined only: where it is has been predicted, not seen. */
  readonly hidden?: readonly boolean[];
  readonly names?: readonly string[];
  /** Poles of the magnets at the faces +x, +y, -x, -y: 1 N, -1 S, 0 none; nothing where there are none. */
  readonly poles?: readonly (readonly number[])[];
}

/** Side of a square, or diameter of a disc [m]; of a rectangle its length and its width. */
export type Size = readonly [side: number, width: number | null];

export interface Trail {
  readonly x: readonly number[];
  readonly y: readonly number[];
  readonly colour: string;
}

export interface Scene {
  readonly blocks: Blocks | null;
  readonly trails?: readonly Trail[];
  /** Draws below everything, such as a video frame. */
  readonly under?: ((view: View) => void) | null;
}

/** How metres become pixels of the canvas. */
export interface View {
  readonly context: CanvasRenderingContext2D;
  readonly zoom: number;
  px(x: number): number;
  py(y: number): number;
}

/** The canvas is never higher than this share of the window. */
const HIGHEST = 0.7;
const FINEST = 2;
/** How opaque blocks are over a video, in which they are seen themselves. */
const SEE_THROUGH = 0.45;

export class TankCanvas {
  readonly element: HTMLCanvasElement;
  private readonly holder: HTMLElement;
  private readonly still: HTMLCanvasElement = document.createElement("canvas");
  private arena: Arena | null = null;
  private size: Size = [0, null];
  private box: Box = boxAround(null);
  private arrows: FlowArrows | null = null;
  private scene: Scene = { blocks: null };
  private stale = true;
  private frames = 0;

  /** Puts the canvas at the end of `parent`, which has to be in the document. */
  constructor(parent: HTMLElement, label: string) {
    this.element = el("canvas", { class: "tank-canvas", role: "img", "aria-label": label, "data-frames": 0 });
    this.holder = el("div", { class: "tank-holder" }, this.element);
    parent.append(this.holder);
    new ResizeObserver(() => this.resize()).observe(this.holder);
    const forget = onThemeChange(() => {
      if (this.element.isConnected) this.refresh();
      else forget();
    });
  }

  /** Sets what does not move: the tank and the size of its blocks. */
  setTank(arena: Arena | null, size: Size, box?: Box): void {
    this.arena = arena;
    this.size = size;
    this.box = box ?? boxAround(arena);
    this.resize();
  }

  setArrows(arrows: FlowArrows | null): void {
    this.arrows = arrows;
    this.stale = true;
  }

  draw(scene: Scene): void {
    this.scene = scene;
    const context = this.element.getContext("2d");
    if (context === null || this.element.width === 0) return;
    const view = this.viewOf(context);
    if (this.stale) this.drawStill();
    context.clearRect(0, 0, this.element.width, this.element.height);
    if (scene.under !== undefined && scene.under !== null) {
      scene.under(view);
      this.strokeOutline(view);
    } else context.drawImage(this.still, 0, 0);
    for (const trail of scene.trails ?? []) drawTrail(view, trail);
    const over = scene.under !== undefined && scene.under !== null;
    if (scene.blocks !== null) drawBlocks(view, scene.blocks, this.size, over ? SEE_THROUGH : 1);
    this.frames += 1;
    this.element.dataset["frames"] = String(this.frames);
  }

  private refresh(): void {
    this.stale = true;
    this.draw(this.scene);
  }

  private resize(): void {
    const [wide, high] = [this.box.x[1] - this.box.x[0], this.box.y[1] - this.box.y[0]];
    const room = this.holder.clientWidth;
    if (room === 0 || !(wide > 0) || !(high > 0)) return;
    const width = Math.min(room, (innerHeight * HIGHEST * wide) / high);
    const fine = Math.min(FINEST, devicePixelRatio || 1);
    this.element.width = Math.round(width * fine);
    this.element.height = Math.round((width * fine * high) / wide);
    this.element.style.setProperty("width", `${Math.round(width)}px`);
    this.element.style.setProperty("height", `${Math.round((width * high) / wide)}px`);
    this.refresh();
  }

  private viewOf(context: CanvasRenderingContext2D): View {
    const zoom = this.element.width / (this.box.x[1] - this.box.x[0]);
    const [left, top] = [this.box.x[0], this.box.y[1]];
    return { context, zoom, px: (x) => (x - left) * zoom, py: (y) => (top - y) * zoom };
  }

  /** Draws what does not change from frame to frame. */
  private drawStill(): void {
    this.still.width = this.element.width;
    this.still.height = this.element.height;
    const context = this.still.getContext("2d");
    if (context === null) return;
    const view = this.viewOf(context);
    const corners = outline(this.arena);
    context.save();
    if (corners.length > 0) {
      context.beginPath();
      corners.forEach(([x, y], index) => {
        if (index === 0) context.moveTo(view.px(x), view.py(y));
        else context.lineTo(view.px(x), view.py(y));
      });
      context.closePath();
      context.fillStyle = styleColour("water");
      context.fill();
      context.clip();
    }
    if (this.arrows !== null) this.drawArrows(view, this.arrows);
    context.restore();
    this.strokeOutline(view);
    this.drawScaleBar(view);
    this.stale = false;
  }

  private strokeOutline(view: View): void {
    const { context } = view;
    const corners = outline(this.arena);
    if (corners.length === 0) return;
    context.beginPath();
    corners.forEach(([x, y]) => context.lineTo(view.px(x), view.py(y)));
    context.closePath();
    context.strokeStyle = styleColour("ink");
    context.lineWidth = fineness() * 1.5;
    context.stroke();
  }

  private drawArrows(view: View, arrows: FlowArrows): void {
    const { context } = view;
    const count = Math.max(2, Math.sqrt(arrows.x.length));
    const longest = (1.1 * (this.box.x[1] - this.box.x[0]) * view.zoom) / count;
    let top = 0;
    for (let index = 0; index < arrows.x.length; index += 1) {
      top = Math.max(top, Math.hypot(at(arrows.u, index), at(arrows.v, index)) || 0);
    }
    if (!(top > 0)) return;
    context.beginPath();
    for (let index = 0; index < arrows.x.length; index += 1) {
      const [u, v] = [at(arrows.u, index), at(arrows.v, index)];
      const length = (longest * Math.hypot(u, v)) / top;
      if (!(length > 1)) continue;
      addArrow(
        context,
        view.px(at(arrows.x, index)),
        view.py(at(arrows.y, index)),
        length,
        Math.atan2(-v, u),
      );
    }
    context.strokeStyle = styleColour("flow");
    context.lineWidth = fineness() * 1.1;
    context.lineCap = "round";
    context.stroke();
  }

  private drawScaleBar(view: View): void {
    const { context } = view;
    const fine = fineness();
    const wide = this.box.x[1] - this.box.x[0];
    const length = niceStep(wide / 6, 1);
    const [x, y] = [10 * fine, this.element.height - 10 * fine];
    context.strokeStyle = styleColour("ink");
    context.fillStyle = styleColour("muted");
    context.lineWidth = fine * 2;
    context.lineCap = "butt";
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + length * view.zoom, y);
    context.stroke();
    context.font = `${12 * fine}px system-ui, sans-serif`;
    context.textAlign = "left";
    context.fillText(quantity(length, "m"), x, y - 6 * fine);
  }
}

/** Returns the colour of every block: one hue per assembly, and grey for a block alone. */
export function assemblyColours(assembly: ArrayLike<number>): string[] {
  const sizes = new Map<number, number>();
  const list = Array.from(assembly);
  for (const index of list) sizes.set(index, (sizes.get(index) ?? 0) + 1);
  const alone = styleColour("block");
  return list.map((index) =>
    (sizes.get(index) ?? 1) > 1 ? (PALETTE[index % PALETTE.length] ?? alone) : alone,
  );
}

function fineness(): number {
  return Math.min(FINEST, devicePixelRatio || 1);
}

function addArrow(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  length: number,
  angle: number,
): void {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const [tipX, tipY] = [x + (length / 2) * cos, y + (length / 2) * sin];
  const head = Math.min(5 * fineness(), 0.42 * length);
  context.moveTo(x - (length / 2) * cos, y - (length / 2) * sin);
  context.lineTo(tipX, tipY);
  for (const aside of [0.5, -0.5]) {
    context.moveTo(tipX, tipY);
    context.lineTo(tipX - head * cos - aside * head * sin, tipY - head * sin + aside * head * cos);
  }
}

function drawTrail(view: View, trail: Trail): void {
  const { context } = view;
  context.beginPath();
  let down = false;
  trail.x.forEach((x, index) => {
    const y = at(trail.y, index);
    if (!Number.isFinite(x + y)) down = false;
    else if (down) context.lineTo(view.px(x), view.py(y));
    else {
      context.moveTo(view.px(x), view.py(y));
      down = true;
    }
  });
  context.strokeStyle = trail.colour;
  context.globalAlpha = 0.6;
  context.lineWidth = fineness() * 1.4;
  context.lineJoin = "round";
  context.stroke();
  context.globalAlpha = 1;
}

function drawBlocks(view: View, blocks: Blocks, [side, width]: Size, opacity: number): void {
  const { context } = view;
  const half = Math.max((side * view.zoom) / 2, 3 * fineness());
  const across = half * (width === null ? 1 : width / side);
  context.lineWidth = Math.min(fineness() * 1.2, 0.22 * half);
  const ink = styleColour("ink");
  for (let index = 0; index < blocks.x.length; index += 1) {
    const [x, y] = [view.px(at(blocks.x, index)), view.py(at(blocks.y, index))];
    if (!Number.isFinite(x + y)) continue;
    const theta = at(blocks.theta, index);
    context.save();
    context.translate(x, y);
    // Angles are counter-clockwise, rows of pixels go down.
    context.rotate(Number.isFinite(theta) ? -theta : 0);
    context.beginPath();
    if (Number.isFinite(theta)) context.rect(-half, -across, 2 * half, 2 * across);
    else context.arc(0, 0, half, 0, 2 * Math.PI);
    const colour = blocks.colours[index] ?? ink;
    if (blocks.hidden?.[index] === true) {
      context.setLineDash([4, 3]);
      context.strokeStyle = colour;
      context.stroke();
    } else {
      context.fillStyle = colour;
      context.globalAlpha = opacity;
      context.fill();
      context.globalAlpha = 1;
      context.strokeStyle = ink;
      context.stroke();
      if (Number.isFinite(theta)) drawPoles(context, half, blocks.poles?.[index] ?? []);
      if (Number.isFinite(theta) && half > 7) drawHeading(context, half, ink);
    }
    context.restore();
    const name = blocks.names?.[index];
    if (name !== undefined && half > 7) drawName(context, name, x, y, Math.min(half, across), ink);
  }
}

/** Draws a bar along every face that is a magnet, as films do: N red, S white. */
function drawPoles(context: CanvasRenderingContext2D, half: number, poles: readonly number[]): void {
  poles.forEach((pole, face) => {
    if (pole === 0) return;
    context.save();
    context.rotate((-face * Math.PI) / 2);
    context.fillStyle = pole > 0 ? "#c1121f" : "#ffffff";
    context.fillRect(0.62 * half, -0.72 * half, 0.32 * half, 1.44 * half);
    context.restore();
  });
}

/** Draws a short line to the block's +x face. */
function drawHeading(context: CanvasRenderingContext2D, half: number, ink: string): void {
  context.beginPath();
  context.moveTo(0.55 * half, 0);
  context.lineTo(half, 0);
  context.strokeStyle = ink;
  context.stroke();
}

function drawName(
  context: CanvasRenderingContext2D,
  name: string,
  x: number,
  y: number,
  half: number,
  ink: string,
): void {
  context.fillStyle = ink;
  context.font = `600 ${Math.min(13 * fineness(), half)}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(name, x, y);
  context.textBaseline = "alphabetic";
}
