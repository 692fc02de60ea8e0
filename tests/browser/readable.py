"""Who can read and use a page: contrast, names and keyboard, by WCAG 2.2 at level AA."""

from __future__ import annotations

from typing import Any

# Text against the first ground behind it that is not clear (AA: 4.5, large text 3).
CONTRAST = """() => {
  const parse = (c) => (c.match(/[\\d.]+/g) ?? []).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const ground = (e) => {
    for (let at = e; at; at = at.parentElement) {
      const c = parse(getComputedStyle(at).backgroundColor);
      if (c.length === 3 || c[3] === 1) return c;
    }
    return [255, 255, 255];
  };
  const seen = (e) => e.checkVisibility({ visibilityProperty: true, opacityProperty: true });
  const bad = [];
  for (const e of document.querySelectorAll("body *:not(script):not(style):not(.skip)")) {
    const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim() !== "");
    if (!own || !seen(e) || e.matches(":disabled")) continue;
    const style = getComputedStyle(e);
    const text = parse(e.namespaceURI.endsWith("svg") ? style.fill : style.color);
    const [a, b] = [light(text), light(ground(e))].sort((x, y) => y - x);
    const large = parseFloat(style.fontSize) >= 24;
    const contrast = (a + 0.05) / (b + 0.05);
    if (contrast < (large ? 3 : 4.5)) bad.push(`${contrast} ${e.outerHTML.slice(0, 120)}`);
  }
  return bad;
}"""
# Everything that takes the focus has a name; every picture says what it shows.
NAMELESS = """() => [...document.querySelectorAll(
    "a[href], button, input, select, summary, canvas, [tabindex='0'], [role=img], img")]
  .filter((e) => e.checkVisibility() && !e.closest("[inert], [aria-hidden=true]"))
  .filter((e) => !(e.textContent.trim() || e.getAttribute("aria-label") || e.labels?.length
    || e.hasAttribute("alt")))
  .map((e) => e.outerHTML.slice(0, 120))"""
# Of a group of radio buttons the one that is on takes the focus, and arrows reach the others.
OUT_OF_REACH = """() => [...document.querySelectorAll("a[href], button, input, select, summary")]
  .filter((e) => e.checkVisibility() && !e.closest("[inert]") && !e.matches(":disabled"))
  .filter((e) => e.tabIndex < 0 && !e.matches("[role=radio], [role=tab]"))
  .map((e) => e.outerHTML.slice(0, 120))"""
FOCUS = """() => {
  const e = document.activeElement;
  return e === document.body ? "" : (e.getAttribute("name") ?? e.textContent.trim());
}"""


MOST_STOPS = 200


def faults(page: Any) -> list[str]:
    """Return what is hard to read, has no name for a screen reader, or no key leads to."""
    return [one for test in (CONTRAST, NAMELESS, OUT_OF_REACH) for one in page.evaluate(test)]


def reached_by_tab(page: Any) -> set[str]:
    """Return the names, or the words, of all that the Tab key leads to; each shows its focus."""
    found: list[str] = []
    for _ in range(MOST_STOPS):
        page.keyboard.press("Tab")
        name = page.evaluate(FOCUS)
        if name in found[:1]:
            return set(found)
        if name:
            found.append(name)
            outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
            assert outline != "none", name
    raise AssertionError(f"after {MOST_STOPS} keys the focus is not back at {found[:1]}")
