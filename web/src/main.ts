/** Reads the page that is embedded in the document and shows it. */

import "./style/index.css";
import { PageError } from "./check";
import { el } from "./dom";
import { type Page, checkPage } from "./page";
import { startTheme } from "./theme";
import { pageHolder } from "./shell";
import { showLive } from "./views/live";
import { showPlay } from "./views/play";
import { showReport } from "./views/report";
import { showRun } from "./views/run";

const VIEWS = { report: showReport, run: showRun, live: showLive, play: showPlay } as const;

async function show(page: Page): Promise<void> {
  await VIEWS[page.view](page);
}

function readPage(): Page {
  const holder = document.getElementById("driftwalk-page");
  if (holder === null) throw new PageError("the document holds no page data: make the report again");
  let content: unknown;
  try {
    content = JSON.parse(holder.textContent ?? "");
  } catch {
    throw new PageError("the page data are not JSON: the file may be cut short");
  }
  return checkPage(content);
}

async function start(): Promise<void> {
  startTheme();
  try {
    await show(readPage());
  } catch (error) {
    const words = error instanceof Error ? error.message : String(error);
    pageHolder().replaceChildren(
      el(
        "main",
        { class: "stopped" },
        el("h1", {}, "This page cannot be shown"),
        el("p", { role: "alert" }, words),
      ),
    );
    if (!(error instanceof PageError)) console.error(error);
  }
  document.documentElement.dataset["ready"] = "yes";
}

if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", () => void start());
else void start();
