/** A map whose cells can be chosen with the keyboard. */

import { type Cell, type Size, moveCell } from "../keyboard";

export interface GridChoice {
  readonly label: string;
  /** The size of the grid that is shown now. */
  size(): Size;
  /** The cell that a first key starts from. */
  here(): Cell;
  /** The cell under the keyboard's cursor, null when there is none. */
  cursor(): Cell | null;
  moved(cell: Cell | null): void;
  select(cell: Cell): void;
}

/** Makes a figure take the focus: arrow keys move a cursor, Enter selects. */
export function useGridKeys(element: HTMLElement, choice: GridChoice): void {
  element.tabIndex = 0;
  element.setAttribute("role", "application");
  element.setAttribute("aria-roledescription", "map");
  element.setAttribute("aria-label", `${choice.label}: arrow keys move over the settings, Enter selects one`);
  element.addEventListener("keydown", (event) => {
    const here = choice.cursor() ?? choice.here();
    if (event.key === "Enter" || event.key === " ") choice.select(here);
    else if (event.key === "Escape") choice.moved(null);
    else {
      const next = moveCell(here, event.key, choice.size());
      if (next === null) return;
      choice.moved(next);
    }
    event.preventDefault();
  });
  element.addEventListener("blur", () => {
    if (choice.cursor() !== null) choice.moved(null);
  });
}
