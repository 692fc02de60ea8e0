/** A playground without a server: workers run the core in this document, and its address keeps the settings. */

import { PageError, plainObject } from "../check";
import { el } from "../dom";
import type { Request } from "../local/playground";
import type { Values } from "../local/tank";
import { type ControlsSection, type Page, checkControls } from "../page";
import { rich } from "../symbols";
import type { Handlers } from "./connection";
import type { Link, Message } from "./socket";

type Item = ControlsSection["items"][number];

/** Time after the last change at which the address shows it [ms]; browsers limit how often it may change. */
const SETTLED_MS = 400;

/** Settings that show what the tank is for. */
const TRIES = [
  ["find C_d and σ_F by hand: one block, until D is down at its noise floor", "blocks=1&latching=none&drag_coefficient=0.8&force_std=0.0003&speed=20"],
  ["let sixteen blocks assemble", "blocks=16&speed=5"],
  ["give their faces poles and magnets", "blocks=12&faces=N%2CS%2CN%2CS&magnets=5x5x2mm%2C1.2T&speed=2"],
  ["let bonds break", "blocks=12&bond_rate=0.05&speed=5"],
] as const;

/** Returns links to settings to try, those that the knobs can stand at. */
export function tries(items: readonly Item[]): HTMLElement {
  const offered = TRIES.filter(([, words]) => settingsIn(words, items, 0).size === words.split("&").length);
  const links = offered.map(([words, settings]) => el("li", {}, el("a", { href: `#${settings}` }, ...rich(words))));
  return el("nav", { class: "tries", "aria-label": "Settings to try" }, el("p", {}, "Try:"), el("ul", {}, ...links));
}

/** Returns what the core needs, null in a page of a server. */
export function localCore(): unknown {
  const holder = document.getElementById("driftwalk-core");
  return holder === null ? null : JSON.parse(holder.textContent ?? "null");
}

/** Runs the page's tank in workers; messages are those of a server. */
export function connectLocal(local: unknown, page: Page, handlers: Handlers): Link {
  const controls = page.sections.find((section) => section.kind === "controls");
  if (controls === undefined) throw new PageError("a playground has settings");
  const { items } = checkControls(controls.content, "controls");
  const first = new Map(items.map((item) => [item.name, item.value]));
  const seed = Number(plainObject(local, "core")["seed"]);
  const now = new Map([...first, ...settingsIn(location.hash, items, seed)]);
  const program = document.getElementById("driftwalk-worker")?.textContent ?? "";
  const address = URL.createObjectURL(new Blob([program], { type: "text/javascript" }));
  const received = (message: Message): void => {
    if (typeof message["seed"] === "number") now.set("seed", message["seed"]);
    handlers.received(message, link);
  };
  const start = (request: Request): Worker => {
    const worker = new Worker(address);
    worker.addEventListener("message", (event: MessageEvent<Message>) => received(event.data));
    worker.addEventListener("error", (event) =>
      received({ type: "note", words: `The tank cannot run here: ${event.message}` }),
    );
    worker.postMessage(request);
    return worker;
  };
  const values = (): Values => Object.fromEntries(now) as unknown as Values;
  const current = (): number => Number(now.get("seed") ?? seed);

  let keeping: ReturnType<typeof setTimeout> | undefined;
  const keep = (): void => {
    clearTimeout(keeping);
    keeping = setTimeout(() => {
      const changed = [...now].filter(([name, value]) => value !== (name === "seed" ? seed : first.get(name)));
      history.replaceState(null, "", `#${new URLSearchParams(changed.map(([name, value]) => [name, String(value)]))}`);
    }, SETTLED_MS);
  };
  let counting: Worker | null = null;
  let moving: Worker | null = null;
  const link: Link = {
    send: (message) => {
      if (message["type"] === "count") {
        counting?.terminate();
        counting = start({ type: "count", local, values: values(), seed: current(), runs: Number(message["runs"]) });
        return;
      }
      if (message["type"] === "set") now.set(String(message["name"]), message["value"]);
      moving?.postMessage(message);
      if (message["type"] !== "ready") keep();
    },
  };
  // Another link that is opened here is another tank.
  addEventListener("hashchange", () => location.hash.includes("=") && location.reload());
  for (const item of items) item.value = now.get(item.name);
  const sections = page.sections.map((section) => {
    if (section.kind !== "controls") return section.content;
    return { ...plainObject(section.content, "controls"), items };
  });
  queueMicrotask(() => {
    received({ type: "page", page: { ...page, sections } });
    moving = start({ type: "begin", local, values: values(), speed: Number(now.get("speed") ?? 1), seed: current() });
  });
  return link;
}

/** Returns the settings of an address, those that a knob can stand at. */
export function settingsIn(hash: string, items: readonly Item[], seed: number): Map<string, unknown> {
  const found = new Map<string, unknown>();
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  for (const item of items) {
    const word = given.get(item.name);
    if (word === null) continue;
    const value = item.kind === "range" ? Number(word) : item.choices.find((choice) => String(choice) === word);
    const fits =
      typeof value === "number"
        ? word !== "" && value >= (item.min ?? -Infinity) && value <= (item.max ?? Infinity)
        : value !== undefined;
    if (fits) found.set(item.name, item.step === 1 ? Math.round(Number(value)) : value);
  }
  const word = given.get("seed");
  if (word !== null && Number.isSafeInteger(Number(word)) && Number(word) >= seed) found.set("seed", Number(word));
  return found;
}
