/** The outcome classes over time of settings that are on no map: one is chosen by its name. */

import { type Context, remembered } from "../context";
import { el, refill } from "../dom";
import type { SettingTimesSection } from "../page";
import { decodeTimes, drawSettingTimes } from "./setting_times";

export async function drawChosenTimes(
  section: SettingTimesSection,
  body: HTMLElement,
  context: Context,
): Promise<void> {
  const times = await decodeTimes(section.over_time, context);
  const choice = remembered(context, `chosen times ${section.id}`, () => ({ setting: 0 }));
  const names = section.settings.map((name, index) => el("option", { value: index }, name));
  const select = el("select", { "aria-label": "Setting" }, ...names);
  const shown = el("div", { class: "setting-times" });
  body.append(el("p", {}, select), shown);
  const show = (): void => {
    refill(shown, () => drawSettingTimes(shown, times(0, choice.setting), context));
    shown.dataset["shown"] = String(choice.setting);
  };
  select.selectedIndex = choice.setting;
  select.addEventListener("change", () => {
    choice.setting = select.selectedIndex;
    show();
  });
  show();
}
