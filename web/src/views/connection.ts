/** The words about the connection in the head of a page. */

import type { Shell } from "../shell";
import { type Link, type Message, connect } from "./socket";

export interface Handlers {
  opened?(link: Link): void;
  received(message: Message, link: Link): void;
  lost?(): void;
}

/** Connects, and says in the head whether the connection stands. */
export function connected(shell: Shell, handlers: Handlers): Link {
  const root = document.documentElement.dataset;
  root["connection"] = "waiting";
  shell.showConnection("connecting", false);
  const link = connect({
    opened: () => {
      root["connection"] = "open";
      shell.showConnection("connected", true);
      handlers.opened?.(link);
    },
    received: (message) => handlers.received(message, link),
    lost: (reason) => {
      root["connection"] = "lost";
      shell.showConnection(
        reason === null ? "connection lost, trying again" : `${reason}; trying again`,
        false,
      );
      handlers.lost?.();
    },
  });
  return link;
}
