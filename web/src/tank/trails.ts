/** Where bodies have been of late, for the trails behind them. */

interface Place {
  readonly time: number;
  readonly x: number;
  readonly y: number;
}

interface Body {
  readonly id: string;
  readonly x_m: number | null;
  readonly y_m: number | null;
}

export class Trails {
  private readonly past = new Map<string, Place[]>();
  private newest = -Infinity;

  /** `duration` is how far back a trail goes [s]. */
  constructor(private readonly duration: number) {}

  clear(): void {
    this.past.clear();
    this.newest = -Infinity;
  }

  /** Takes where the bodies are at a time [s]. */
  add(time: number, bodies: readonly Body[]): void {
    // The watched run has restarted.
    if (time < this.newest) this.clear();
    this.newest = time;
    for (const body of bodies) {
      const trail = this.past.get(body.id) ?? [];
      trail.push({ time, x: body.x_m ?? Number.NaN, y: body.y_m ?? Number.NaN });
      this.past.set(body.id, trail);
    }
    // Those of bodies that are no longer there fade as well.
    for (const [id, trail] of this.past) {
      while (time - (trail[0]?.time ?? time) > this.duration) trail.shift();
      if (trail.length === 0) this.past.delete(id);
    }
  }

  /** Returns the places of every body, the oldest first; not a number where it was not known. */
  all(): { readonly id: string; readonly x: number[]; readonly y: number[] }[] {
    return [...this.past].map(([id, trail]) => ({
      id,
      x: trail.map((place) => place.x),
      y: trail.map((place) => place.y),
    }));
  }
}
