/** Which tool is in the hand; pointers and keys go to it. */

import { setAttribute } from "./dom.js";
import { store } from "./store.js";
import { goalTool } from "./tools/goal.js";
import { handTool } from "./tools/hand.js";
import { makeFences, polygonTool } from "./tools/polygon.js";
import { sketchTool } from "./tools/sketch.js";

const HOT = { KeyG: "goal", KeyS: "sketch", KeyF: "fence", KeyK: "keepout", KeyH: "hand" };

/** @param {{orders: object, choose: Function, changed: Function, say: Function}} parts */
export function makeTools(parts) {
  const fences = makeFences(parts);
  const all = {
    goal: goalTool(parts),
    sketch: sketchTool(parts),
    fence: polygonTool({ ...parts, fences, kind: "stay_inside", name: "fence" }),
    keepout: polygonTool({ ...parts, fences, kind: "keep_out", name: "keepout" }),
    hand: handTool(parts),
  };
  const buttons = [...document.querySelectorAll(".tool[data-tool]")];
  let current = all.goal;

  const tools = {
    all,
    get current() {
      return current;
    },
    /** Take another tool. */
    take(name) {
      if (!all[name] || current === all[name]) return;
      current.cancel();
      current.leave?.();
      current = all[name];
      current.begin?.();
      document.body.dataset.tool = name;
      for (const button of buttons) setAttribute(button, "aria-pressed", String(button.dataset.tool === name));
      store.set("tool", name);
      parts.changed();
    },
    /** A hot key of a tool; driving keys come first while driving by hand. */
    key(event) {
      if (current.key?.(event)) return true;
      const name = HOT[event.code];
      if (!name || event.shiftKey) return false;
      this.take(name);
      return true;
    },
    keyUp: (event) => current.keyUp?.(event.key, event.code),
    fences: () => fences.get(),
    get edits() {
      return current === all.fence || current === all.keepout;
    },
    get marked() {
      return current.marked ?? null;
    },
    draw: (g, surface, labels) => current.draw(g, surface, labels),
    // What surfaces call: whatever tool is in the hand.
    down: (event) => current.down(event),
    move: (event) => current.move(event),
    up: (event) => current.up(event),
    hover: (event) => current.hover?.(event),
    cancel: () => current.cancel(),
    get pen() {
      return current.pen ?? false;
    },
  };
  for (const button of buttons) button.addEventListener("click", () => tools.take(button.dataset.tool));
  return tools;
}
