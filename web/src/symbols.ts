/** Symbols with an index, such as C_d, as they are printed. */

import { type Child, el, svg } from "./dom";

export interface Piece {
  readonly text: string;
  /** The index of a symbol, null for plain text. */
  readonly index: string | null;
}

const SYMBOL = /(?<![\p{L}\p{Nd}_])(\p{L}|sigma)_(\p{L}|\d+)(?![\p{L}\p{Nd}_])/gu;

/** Splits text into plain pieces and symbols with an index. */
export function pieces(text: string): Piece[] {
  const found: Piece[] = [];
  let from = 0;
  for (const match of text.matchAll(SYMBOL)) {
    if (match.index > from) found.push({ text: text.slice(from, match.index), index: null });
    const letter = match[1] === "sigma" ? "σ" : (match[1] ?? "");
    found.push({ text: letter, index: match[2] ?? "" });
    from = match.index + match[0].length;
  }
  if (from < text.length) found.push({ text: text.slice(from), index: null });
  return found;
}

/** Returns text for HTML, its symbols in italics with their index lowered. */
export function rich(text: string): Child[] {
  return pieces(text).map((piece) =>
    piece.index === null
      ? piece.text
      : el("span", { class: "symbol" }, el("i", {}, piece.text), el("sub", {}, piece.index)),
  );
}

/** Returns text for SVG, its symbols in italics with their index lowered. */
export function richSvg(text: string): SVGTSpanElement[] {
  return pieces(text).flatMap((piece, place, all) => {
    // A lowered index shifts all that follows it, so the next piece is shifted back.
    const raised = place > 0 && all[place - 1]?.index !== null ? { dy: "-0.25em" } : {};
    if (piece.index === null) return [svg("tspan", raised, piece.text)];
    return [
      svg("tspan", { "font-style": "italic", ...raised }, piece.text),
      svg("tspan", { dy: "0.25em", class: "index" }, piece.index),
    ];
  });
}

/** Returns text without the underscores of its symbols, for labels that are read aloud. */
export function spoken(text: string): string {
  return pieces(text)
    .map((piece) => (piece.index === null ? piece.text : `${piece.text} ${piece.index}`))
    .join("");
}

/** Returns the symbol in a label when it has one, else the label up to its first comma. */
export function shortName(label: string): string {
  const symbol = pieces(label).find((piece) => piece.index !== null);
  return symbol === undefined ? (label.split(", ")[0] ?? label) : `${symbol.text}_${symbol.index ?? ""}`;
}
