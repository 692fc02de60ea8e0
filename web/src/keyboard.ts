/** Keys that move through a grid or through time. */

export interface Size {
  readonly rows: number;
  readonly columns: number;
}

export interface Cell {
  readonly row: number;
  readonly column: number;
}

/** Returns the cell that a key leads to, null when the key moves nothing; row 0 is at the bottom. */
export function moveCell(cell: Cell, key: string, size: Size): Cell | null {
  const to = (row: number, column: number): Cell => ({
    row: Math.min(size.rows - 1, Math.max(0, row)),
    column: Math.min(size.columns - 1, Math.max(0, column)),
  });
  switch (key) {
    case "ArrowLeft":
      return to(cell.row, cell.column - 1);
    case "ArrowRight":
      return to(cell.row, cell.column + 1);
    case "ArrowUp":
      return to(cell.row + 1, cell.column);
    case "ArrowDown":
      return to(cell.row - 1, cell.column);
    case "Home":
      return to(cell.row, 0);
    case "End":
      return to(cell.row, size.columns - 1);
    case "PageUp":
      return to(size.rows - 1, cell.column);
    case "PageDown":
      return to(0, cell.column);
    default:
      return null;
  }
}

/** Returns the sample that a key leads to in a replay, null when the key moves nothing. */
export function moveSample(sample: number, key: string, count: number): number | null {
  const to = (wanted: number): number => Math.min(count - 1, Math.max(0, wanted));
  const leap = Math.max(1, Math.round(count / 50));
  switch (key) {
    case "ArrowLeft":
    case "ArrowDown":
      return to(sample - 1);
    case "ArrowRight":
    case "ArrowUp":
      return to(sample + 1);
    case "PageDown":
      return to(sample - leap);
    case "PageUp":
      return to(sample + leap);
    case "Home":
      return 0;
    case "End":
      return count - 1;
    default:
      return null;
  }
}
