/** The words about the connection in the head of a page. */

import { type Page, checkPage } from "../page";
import type { Shell } from "../shell";
import { type Link, type Message, connect } from "./socket";

export interface Handlers {
  opened?(link: Link): void;
  received(message: Message, link: Link): void;
  lost?(): void;
}

/**
 * Connects, and says in the head whether the connection stands.
 *
 * `first` is the page that the document was made for. The server that comes back may be another one.
 */
export function connected(shell: Shell, first: Page, handlers: Handlers): Link {
  const root = document.documentElement.dataset;
  root["connection"] = "waiting";
  shell.showConnection("connecting", false);
  const link = connect({
    opened: () => {
      root["connection"] = "open";
      shell.showConnection("connected", true);
      handlers.opened?.(link);
    },
    received: (message) => {
      if (message.type === "page" && isAnother(checkPage(message["page"]), first)) location.reload();
      else handlers.received(message, link);
    },
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

/** Returns whether a page needs another front end than the one that the document was made for. */
export function isAnother(page: Page, first: Page): boolean {
  return page.view !== first.view || page.driftwalk_version !== first.driftwalk_version;
}
