/** Light and dark: what the system prefers until the reader presses the button; paper is light. */

export type Theme = "light" | "dark";

const listeners = new Set<() => void>();
let chosen: Theme | null = null;
let printing = false;

export function currentTheme(): Theme {
  if (printing) return "light";
  if (chosen !== null) return chosen;
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

export function isDark(): boolean {
  return currentTheme() === "dark";
}

/** Calls back whenever colours that are not styled by CSS have to be redrawn. */
export function onThemeChange(listener: () => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

export function startTheme(): void {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", apply);
  matchMedia("print").addEventListener("change", (event) => setPrinting(event.matches));
  window.addEventListener("beforeprint", () => setPrinting(true));
  window.addEventListener("afterprint", () => setPrinting(false));
  printing = matchMedia("print").matches;
  apply();
}

export function toggleTheme(): void {
  chosen = currentTheme() === "dark" ? "light" : "dark";
  apply();
}

/** Returns the value of a colour of the style sheet, for a canvas. */
export function styleColour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

function setPrinting(now: boolean): void {
  if (printing === now) return;
  printing = now;
  apply();
}

function apply(): void {
  const theme = currentTheme();
  if (document.documentElement.dataset["theme"] === theme) return;
  document.documentElement.dataset["theme"] = theme;
  for (const listener of listeners) listener();
}
