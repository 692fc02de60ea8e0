/** Where it all comes from: the command, the inputs, the settings, how to cite. */

import { el } from "../dom";
import type { ManifestSection } from "../page";
import { table } from "../parts";

export function drawManifest(section: ManifestSection, body: HTMLElement): void {
  if (section.command !== null && section.command !== "") body.append(copyable("Command", section.command));
  if (section.inputs.length > 0) {
    const rows = section.inputs.map((input) => [input.role, input.name, input.sha256 ?? "–"]);
    body.append(
      el("h3", { class: "space" }, "Inputs"),
      table("Inputs", ["role", "name", "SHA-256"], rows, () => false),
    );
  }
  body.append(el("h3", { class: "space" }, "Settings"), tree(section.entries));
  if (section.cite !== null && section.cite !== "") {
    body.append(el("h3", { class: "space" }, "How to cite"), el("p", { class: "lead" }, section.cite));
  }
  if (section.bibtex !== null && section.bibtex !== "") body.append(copyable("BibTeX", section.bibtex));
}

/** Returns text with a button that copies it. */
function copyable(name: string, content: string): HTMLElement {
  const code = el("pre", { tabindex: 0, "aria-label": name }, content);
  const button = el("button", { type: "button", class: "copy" }, "Copy");
  const said = el("span", { class: "unseen", role: "status" });
  button.addEventListener("click", () => {
    void copy(content, code).then((done) => {
      button.textContent = done ? "Copied" : "Selected: press Ctrl+C";
      said.textContent = done ? `${name} copied` : `${name} selected`;
      setTimeout(() => {
        button.textContent = "Copy";
      }, 2000);
    });
  });
  return el("div", { class: "copyable" }, code, button, said);
}

/** Copies text; where the browser forbids it, selects it so that the reader can. */
async function copy(content: string, shown: HTMLElement): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(content);
    return true;
  } catch {
    getSelection()?.selectAllChildren(shown);
    return false;
  }
}

/** Returns nested entries, folded. */
function tree(entries: unknown): HTMLElement {
  const list = el("dl", { class: "tree" });
  for (const [key, value] of pairs(entries)) {
    if (isNested(value)) {
      const fold = el("details", {}, el("summary", {}, key));
      fold.addEventListener("toggle", () => {
        if (fold.open && fold.childElementCount === 1) fold.append(tree(value));
      });
      list.append(fold);
    } else {
      list.append(el("div", {}, el("dt", {}, key), el("dd", {}, leaf(value))));
    }
  }
  return list;
}

function pairs(entries: unknown): [string, unknown][] {
  if (typeof entries !== "object" || entries === null) return [["value", entries]];
  return Object.entries(entries);
}

function isNested(value: unknown): boolean {
  if (typeof value !== "object" || value === null) return false;
  const items = Object.values(value);
  return (
    !Array.isArray(value) ||
    items.length > 8 ||
    items.some((item) => typeof item === "object" && item !== null)
  );
}

function leaf(value: unknown): string {
  if (Array.isArray(value)) return value.length === 0 ? "none" : value.map(leaf).join(", ");
  if (value === null || value === undefined || value === "") return "–";
  if (typeof value === "boolean") return value ? "yes" : "no";
  return String(value);
}
