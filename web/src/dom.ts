/** Elements from code. Text becomes text nodes only, so that nothing from data is ever markup. */

export type Child = Node | string | null | undefined | false;
export type Attributes = Readonly<Record<string, string | number | boolean | null | undefined>>;

const SVG = "http://www.w3.org/2000/svg";

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  return filled(document.createElement(tag), attributes, children);
}

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): SVGElementTagNameMap[K] {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

export function set(element: Element, attributes: Attributes): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) element.removeAttribute(name);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
}

/** Refills an element; it keeps its size until the new content is there, so that the page does not jump. */
export function refill(element: HTMLElement, fill: () => void): void {
  element.style.setProperty("min-height", `${element.clientHeight}px`);
  element.replaceChildren();
  fill();
  element.style.removeProperty("min-height");
}

let serial = 0;

/** Returns an id that no other element of this page has. */
export function freshId(stem: string): string {
  serial += 1;
  return `${stem}-${serial}`;
}

function filled<E extends Element>(element: E, attributes: Attributes, children: Child[]): E {
  set(element, attributes);
  for (const child of children) {
    if (child !== null && child !== undefined && child !== false) element.append(child);
  }
  return element;
}
