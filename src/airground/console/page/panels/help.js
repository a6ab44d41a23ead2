/** Help and keys; and the menu of layers. */

import { byId, make, setAttribute } from "../dom.js";
import { LAYERS, toggleLayer } from "../overlay.js";
import { closeSheet, openSheet } from "../popups.js";
import { store } from "../store.js";
import { switchTheme } from "./header.js";

const KEYS = [
  ["Space", "STOP, whatever has the focus"], ["1 … 9", "choose a robot"], ["G", "goal: click, shift-click for several"], ["S", "sketch a path"],
  ["F", "fence: stay inside"], ["K", "keep out"], ["H", "drive by hand: arrows, W A S D"], ["Enter", "close an area, drive a path, go"],
  ["Esc", "cancel; with nothing to cancel, rest"], ["R", "the chosen robot rests"], ["Del", "delete the chosen area"], ["C", "calibrate"],
  ["B", "bird’s-eye or live image"], ["L", "layers"], ["+  −  0", "zoom in, out, whole image"], ["?", "this help"],
];

export function makeHelp() {
  const sheet = byId("help-overlay");
  const close = make("button", { class: "primary", text: "Close" });
  const theme = make("button", { class: "quiet", text: "Dark or light" });
  theme.addEventListener("click", switchTheme);
  close.addEventListener("click", () => closeSheet());
  const keys = make("dl", { class: "keys" }, ...KEYS.map(([key, what]) => make("div", {}, make("dt", {}, make("kbd", { text: key })), make("dd", { text: what }))));
  sheet.append(
    make("div", { class: "card help" },
      make("h1", { text: "Drive what the camera sees" }),
      make("p", { text: "Take the controls. Choose a robot, click the ground, and it drives there. Or draw a path, look at what becomes of it, and let it be driven. One person has the controls; anybody may press STOP." }),
      make("p", { class: "muted small", text: "In the image: wheel or two fingers zoom, the right button pans. With the keyboard: arrow keys move a cross, Enter acts there." }),
      make("div", { class: "row" }, close, theme),
      keys,
    ),
  );
  sheet.addEventListener("pointerdown", (event) => event.target === sheet && closeSheet());
  const toggle = () => (sheet.hidden ? openSheet(sheet) : closeSheet());
  byId("help-button").addEventListener("click", toggle);
  return toggle;
}

export function makeLayersMenu() {
  const menu = byId("layers-menu");
  const rows = Object.entries(LAYERS).map(([name, words]) => {
    const state = make("b");
    const button = make("button", { class: "layer", testid: `layer-${name}` }, make("span", { text: words }), state);
    button.addEventListener("click", () => toggleLayer(name));
    menu.append(button);
    return { name, button, state };
  });
  const draw = () => {
    for (const { name, button, state } of rows) {
      const on = store.get("layers")[name];
      setAttribute(button, "aria-pressed", String(on));
      state.textContent = on ? "shown" : "off";
    }
  };
  store.on(["layers"], draw);
  draw();
}
