/** Drive by hand: keys or the stick on the image. Orders are repeated while something is held, and zeros end it. */

import { setAttribute, show } from "../dom.js";
import { holdsControls, store } from "../store.js";

const EVERY_MS = 1000 / 15;
const GENTLE = 0.4;
const ZEROS = 3; // one may be the one that is lost
const coarse = window.matchMedia("(pointer: coarse)");
const KEYS = {
  ArrowUp: "forward", KeyW: "forward", ArrowDown: "back", KeyS: "back", ArrowLeft: "left", KeyA: "left", ArrowRight: "right", KeyD: "right",
};

export function handTool({ orders, changed, say }) {
  const held = new Set();
  let gentle = false;
  let stick = null; // [turn, forward], each -1 to 1
  let timer = 0;
  let robot = "";
  let rest = 0;

  const wish = () => {
    if (stick) return { forward: -stick[1], turn: -stick[0] };
    const share = gentle ? GENTLE : 1;
    const axis = (plus, minus) => (held.has(plus) ? share : 0) - (held.has(minus) ? share : 0);
    return { forward: axis("forward", "back"), turn: axis("left", "right") };
  };
  const idle = () => held.size === 0 && !stick;

  function beat() {
    if (idle()) {
      orders.stream({ kind: "hand", robot, forward: 0, turn: 0 });
      if (--rest <= 0) {
        clearInterval(timer);
        timer = 0;
      }
    } else orders.stream({ kind: "hand", robot, ...wish() });
    changed();
  }

  function begin() {
    if (timer) return beat();
    robot = store.get("chosen") ?? "";
    if (!robot) return say("Choose a robot first.", "warning");
    if (!holdsControls()) return say("You are watching. Take the controls first.", "warning");
    rest = ZEROS;
    timer = setInterval(beat, EVERY_MS);
    return beat();
  }

  function letGo() {
    held.clear();
    stick = null;
    rest = ZEROS;
    if (timer) beat();
    moveKnob();
    changed();
  }

  const area = document.getElementById("stick");
  const knob = document.getElementById("stick-knob");
  function moveKnob() {
    const reach = area.clientWidth * 0.32;
    const { forward, turn } = wish();
    knob.style.transform = `translate(${-turn * reach}px, ${-forward * reach}px)`;
  }
  function pull(event) {
    const box = area.getBoundingClientRect();
    const reach = box.width * 0.32;
    const x = (event.clientX - box.left - box.width / 2) / reach;
    const y = (event.clientY - box.top - box.height / 2) / reach;
    const over = Math.max(Math.hypot(x, y), 1);
    const still = (value) => (Math.abs(value) < 0.08 ? 0 : value); // a thumb is not a rest
    stick = [still(x / over), still(y / over)];
    moveKnob();
    begin();
  }
  area.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    area.setPointerCapture(event.pointerId);
    pull(event);
  });
  area.addEventListener("pointermove", (event) => stick && pull(event));
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) area.addEventListener(kind, () => stick && letGo());
  window.addEventListener("blur", letGo);
  document.addEventListener("visibilitychange", () => document.hidden && letGo());
  store.on(["chosen", "controls"], () => !idle() && letGo());

  return {
    name: "hand",
    hint() {
      const name = store.get("chosen");
      if (!name) return "There is no robot yet.";
      return coarse.matches ? `Drag the stick: ${name} drives as far as you pull. Let go and it stands.` : `Drive ${name}: arrow keys or W A S D, Shift for gently, or the stick. Let go and it stands.`;
    },
    down() {},
    move() {},
    up() {},
    cancel() {},
    escape() {
      const had = !idle();
      letGo();
      return had;
    },
    begin() {
      show(area, true);
      moveKnob();
    },
    leave() {
      letGo();
      show(area, false);
    },
    /** @returns {boolean} whether the key was one to drive with */
    key(event) {
      gentle = event.shiftKey;
      const way = KEYS[event.code];
      if (!way || event.ctrlKey || event.metaKey || event.altKey) return false;
      if (!event.repeat) {
        held.add(way);
        moveKnob();
        begin();
      }
      return true;
    },
    keyUp(key, code) {
      if (key === "Shift") gentle = false;
      const way = KEYS[code];
      if (!way || !held.delete(way)) return;
      if (idle()) letGo();
      moveKnob();
    },
    draw() {
      setAttribute(area, "data-active", String(!idle()));
    },
  };
}
