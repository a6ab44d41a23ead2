/** Tabs of the column at the side; and which of the two pictures is the large one. */

import { byId, kept, setAttribute, setText, show } from "../dom.js";

export function makeTabs() {
  const tabs = [...document.querySelectorAll('[role="tab"]')];
  const panels = ["robots", "calibrate", "events"];

  function open(name, focus = false) {
    document.body.dataset.tab = name;
    for (const tab of tabs) {
      const on = tab.dataset.tab === name;
      setAttribute(tab, "aria-selected", String(on));
      tab.tabIndex = on ? 0 : -1;
      if (on && focus) tab.focus();
    }
    for (const panel of panels) show(byId(`panel-${panel}`), panel === name);
  }
  for (const tab of tabs) {
    tab.addEventListener("click", () => open(tab.dataset.tab));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const seen = tabs.filter((one) => one.offsetParent !== null);
      open(seen[(seen.indexOf(tab) + step + seen.length) % seen.length].dataset.tab, true);
      event.preventDefault();
    });
  }
  // A tab that only compact pages have must not stay open on a wide one.
  window.matchMedia("(min-width: 1000px)").addEventListener("change", (event) => {
    if (event.matches && document.body.dataset.tab === "plots") open("robots");
  });
  return open;
}

/** Change places of live image and bird's-eye view. */
export function makeSwap() {
  const main = byId("slot-main"), side = byId("slot-side"), button = byId("swap");
  let swapped = false;
  function swap() {
    swapped = !swapped;
    main.append(byId(swapped ? "bird-frame" : "view-frame"));
    side.append(byId(swapped ? "view-frame" : "bird-frame"));
    setText(byId("swap-text"), swapped ? "Live image" : "Bird’s-eye");
    setAttribute(button, "aria-pressed", String(swapped));
    kept.set("swapped", swapped);
  }
  button.addEventListener("click", swap);
  if (kept.get("swapped", false)) swap();
  return swap;
}
