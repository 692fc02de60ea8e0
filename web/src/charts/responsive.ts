/** Figures that are drawn for the width they have, and again when it or the theme changes. */

import { el } from "../dom";
import { onThemeChange } from "../theme";

type Draw = (width: number) => Element;

const observer = new ResizeObserver((entries) => {
  for (const entry of entries) redraws.get(entry.target)?.(entry.contentRect.width);
});
const redraws = new WeakMap<Element, (width: number) => void>();

export interface Figure {
  readonly element: HTMLElement;
  /** Draw again: what is shown has changed. */
  redraw(): void;
}

/** Puts a figure at the end of `parent`, which has to be in the document. */
export function figure(parent: Element, className: string, draw: Draw): Figure {
  const element = el("div", { class: `figure ${className}` });
  parent.append(element);
  let width = 0;
  const redraw = (): void => {
    if (width > 0) element.replaceChildren(draw(width));
  };
  redraws.set(element, (now) => {
    if (now <= 0 || Math.abs(now - width) < 1) return;
    width = now;
    redraw();
  });
  width = Math.floor(element.clientWidth);
  redraw();
  observer.observe(element);
  const forget = onThemeChange(() => {
    if (element.isConnected) redraw();
    else forget();
  });
  return { element, redraw };
}
