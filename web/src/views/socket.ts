/** The connection to the server: found again when it is lost, longer and longer pauses between. */

export type Message = Readonly<Record<string, unknown>> & { readonly type: string };

export interface Listener {
  /** The connection stands; what was said before is forgotten on the other side. */
  opened(): void;
  received(message: Message): void;
  /** The connection is lost; why, when the server said it. */
  lost(reason: string | null): void;
}

export interface Link {
  /** Sends a message; without a connection it is dropped. */
  send(message: Readonly<Record<string, unknown>>): void;
}

const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 5000;

/** Connects to the server that the page came from, and again whenever the connection is lost. */
export function connect(listener: Listener): Link {
  let socket: WebSocket | null = null;
  let pause = FIRST_PAUSE_MS;

  const open = (): void => {
    socket = new WebSocket(address());
    socket.addEventListener("open", () => listener.opened());
    socket.addEventListener("message", (event) => {
      pause = FIRST_PAUSE_MS;
      const message = parsed(event.data);
      if (message !== null) listener.received(message);
    });
    socket.addEventListener("close", (event) => {
      socket = null;
      listener.lost(event.reason === "" ? null : event.reason);
      setTimeout(open, pause);
      pause = nextPause(pause);
    });
  };
  open();
  return {
    send: (message) => {
      if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
    },
  };
}

/** Returns the pause after the next failure [ms]. */
export function nextPause(pause: number): number {
  return Math.min(LONGEST_PAUSE_MS, 2 * pause);
}

/** Returns the object that a message holds, null when it is none with a type. */
export function parsed(data: unknown): Message | null {
  if (typeof data !== "string") return null;
  try {
    const content: unknown = JSON.parse(data);
    const isMessage =
      typeof content === "object" &&
      content !== null &&
      "type" in content &&
      typeof content.type === "string";
    return isMessage ? (content as Message) : null;
  } catch {
    return null;
  }
}

function address(): string {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  return `${scheme}//${location.host}/ws${location.search}`;
}
