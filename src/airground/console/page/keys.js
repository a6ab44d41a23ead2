/** Keys of the whole page, apart from the space bar, which is STOP and nobody else's. */

import { byId } from "./dom.js";
import { closePop, closeSheet, togglePop } from "./popups.js";
import { store } from "./store.js";

const MOVES = /^(?:Arrow|Page|Home$|End$)/; // keys that move a slider

/** @param {{tools: object, surfaces: () => object, choose: Function, orders: object, openTab: Function, swap: Function, help: Function}} parts */
export function makeKeys({ tools, surfaces, choose, orders, openTab, swap, help }) {
  const plain = {
    KeyR: () => store.get("chosen") && orders.send({ kind: "rest", robot: store.get("chosen") }),
    KeyC: () => openTab("calibrate", true),
    KeyB: swap,
    KeyL: () => togglePop(byId("layers-menu"), byId("layers-button")),
    Delete: () => tools.current.remove?.(),
    Backspace: () => tools.current.remove?.(),
  };
  const signs = { "?": help, "+": () => surfaces().zoom(1.4), "-": () => surfaces().zoom(1 / 1.4), 0: () => surfaces().fit() };

  function escape() {
    if (closePop() || closeSheet()) return;
    tools.current.escape();
  }

  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") return void escape();
    const { target } = event;
    // Whoever types, or moves a slider, means that.
    if (target instanceof HTMLInputElement && (target.type !== "range" || MOVES.test(event.key))) return;
    if (target.closest?.('[role="tablist"]') && event.key.startsWith("Arrow")) return;
    if (event.key === "Enter") {
      if (!(target instanceof HTMLButtonElement)) tools.current.enter?.();
      return;
    }
    if (tools.key(event)) return void event.preventDefault();
    if (event.repeat) return;
    const digit = /^(?:Digit|Numpad)([1-9])$/.exec(event.code);
    const robot = digit && store.get("hello")?.site.robots[Number(digit[1]) - 1];
    const act = robot ? () => choose(robot.name) : signs[event.key] ?? (event.shiftKey ? null : plain[event.code]);
    if (!act) return;
    event.preventDefault();
    act();
  }, true);
  window.addEventListener("keyup", (event) => tools.keyUp(event), true);
}
