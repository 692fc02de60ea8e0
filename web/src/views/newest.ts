/** Draws the newest of what arrives, at the pace of the screen. */

/** Returns what takes the newest state; `draw` is called once for each picture of the screen. */
export function newestWins<T>(draw: (state: T) => void): (state: T) => void {
  let waiting: { state: T } | null = null;
  return (state) => {
    if (waiting !== null) {
      waiting.state = state;
      return;
    }
    waiting = { state };
    requestAnimationFrame(() => {
      const newest = waiting;
      waiting = null;
      if (newest !== null) draw(newest.state);
    });
  };
}
