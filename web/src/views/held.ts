/** A frame that waits a while for a better one: what is shown at last is the newest all the same. */

export class HeldFrame<T> {
  private held: { frame: T } | null = null;
  private timer: ReturnType<typeof setTimeout> | null = null;

  constructor(private readonly take: (frame: T) => void) {}

  /** Keeps a frame, the newest; it is taken after `patience` [ms] when no frame is taken before. */
  hold(frame: T, patience: number): void {
    this.held = { frame };
    this.timer ??= setTimeout(() => this.flush(), patience);
  }

  /** Takes the frame that waits now: nothing will follow it. */
  flush(): void {
    const waiting = this.held;
    this.drop();
    if (waiting !== null) this.take(waiting.frame);
  }

  /** Forgets the frame that waits: a newer one is taken. */
  drop(): void {
    this.held = null;
    if (this.timer !== null) clearTimeout(this.timer);
    this.timer = null;
  }
}
