/** What surrounds the sections: title, state, contents, theme button, foot. */

import { el, svg } from "./dom";
import type { Page, RawSection, State } from "./page";
import { rich } from "./symbols";
import { toggleTheme } from "./theme";
import { percent } from "./units";

/** A line of the contents; the first one of a run stands out. */
type Link = Pick<RawSection, "id" | "title"> & { readonly first?: boolean };

export interface Shell {
  readonly main: HTMLElement;
  showState(state: State | null): void;
  /** Shows another page's title. */
  showPage(page: Page): void;
  showConnection(words: string, open: boolean): void;
  /** Offers the page as a file. */
  showSaving(address: string): void;
  showContents(sections: readonly Link[]): void;
}

/** Builds the shell into the document and returns its parts. */
export function makeShell(page: Page): Shell {
  const state = el("p", { class: "state", role: "status" });
  const bar = el("progress", { max: 1, "aria-label": "progress", hidden: true });
  const connection = el("p", { class: "connection", role: "status", hidden: true });
  const contents = el("nav", { class: "contents", "aria-label": "Contents" });
  const main = el("main", { id: "main" });
  const titles = el("div", {});
  const saving = el("a", { class: "saving", hidden: true }, "Save as a file");
  const header = el(
    "header",
    { class: "head" },
    el("div", { class: "titles" }, titles, state, bar),
    el("div", { class: "tools" }, connection, saving, themeButton()),
  );
  const columns = el("div", { class: "layout" }, contents, main);
  const foot = el("footer", { class: "foot" });
  pageHolder().replaceChildren(
    el("a", { class: "skip", href: "#main" }, "Skip to the content"),
    header,
    columns,
    foot,
  );
  document.body.dataset["view"] = page.view;
  const showPage = (now: Page): void => {
    document.title =
      now.subtitle === null || now.subtitle === "" ? now.title : `${now.title} · ${now.subtitle}`;
    const subtitle =
      now.subtitle !== null && now.subtitle !== "" && el("p", { class: "subtitle" }, ...rich(now.subtitle));
    titles.replaceChildren(el("h1", {}, ...rich(now.title)), ...(subtitle === false ? [] : [subtitle]));
    foot.textContent = footText(now);
  };
  showPage(page);
  return {
    main,
    showPage,
    showSaving: (address) => {
      saving.href = address;
      saving.hidden = false;
    },
    showState: (now) => showState(now, state, bar),
    showConnection: (words, open) => {
      connection.hidden = false;
      connection.textContent = words;
      connection.dataset["open"] = open ? "yes" : "no";
    },
    showContents: (sections) => showContents(sections, contents),
  };
}

function showState(now: State | null, words: HTMLElement, bar: HTMLProgressElement): void {
  const running = now !== null && !now.finished;
  bar.hidden = !running || now.progress === null;
  if (running && now.progress !== null) bar.value = now.progress;
  const share = running && now.progress !== null ? `${percent(now.progress)} done` : null;
  // Without a share the words say what there is to say: that it runs, or that it is not there.
  const text = [share, now?.words ?? (running ? "running" : null)].filter((part) => part !== null).join(" · ");
  words.textContent = text;
  words.hidden = text === "";
  const root = document.documentElement.dataset;
  root["finished"] = running ? "no" : "yes";
  root["progress"] = now?.progress === null || now === null ? "" : String(now.progress);
}

function showContents(sections: readonly Link[], contents: HTMLElement): void {
  const links = sections.map((section) =>
    el("li", { class: section.first && "of-run" }, el("a", { href: `#${section.id}` }, ...rich(section.title))),
  );
  // Folded on a narrow screen, always open on a wide one.
  const fold = el("details", {}, el("summary", {}, "Contents"), el("ol", {}, ...links));
  fold.open = matchMedia("(min-width: 1100px)").matches;
  contents.replaceChildren(...(sections.length > 1 ? [fold] : []));
}

function themeButton(): HTMLButtonElement {
  const icon = svg(
    "svg",
    { viewBox: "0 0 20 20", width: 18, height: 18, "aria-hidden": "true" },
    svg("circle", { cx: 10, cy: 10, r: 7.5, fill: "none", stroke: "currentColor", "stroke-width": 1.6 }),
    svg("path", { d: "M10 2.5A7.5 7.5 0 0 1 10 17.5Z", fill: "currentColor" }),
  );
  const button = el(
    "button",
    { type: "button", class: "theme", "aria-label": "Switch between light and dark", title: "light or dark" },
    icon,
  );
  button.addEventListener("click", toggleTheme);
  return button;
}

function footText(page: Page): string {
  const program = page.driftwalk_version === null ? "driftwalk" : `driftwalk ${page.driftwalk_version}`;
  return page.created_utc === null ? program : `${program} · ${page.created_utc}`;
}

/** Returns where the page is built: beside its data, which stay in the document. */
export function pageHolder(): HTMLElement {
  const holder = document.getElementById("app");
  if (holder !== null) return holder;
  const made = el("div", { id: "app" });
  document.body.append(made);
  return made;
}
