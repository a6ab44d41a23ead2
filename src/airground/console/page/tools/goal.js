/** Click a robot to choose it, click the ground to send it there; drag from there to say how it shall stand in the end. */

import { arrow } from "../overlay/draw.js";
import { colourOf, drawGoal } from "../overlay/robots.js";
import { chosenRobot, store } from "../store.js";

const NEAR_PX = 22;
const DRAG_PX = 26; // less is a click with an unsteady hand
const MOST_GOALS = 50;
const coarse = window.matchMedia("(pointer: coarse)");

export function goalTool({ orders, choose, changed, say }) {
  let several = false; // a finger has no shift key
  let list = [];
  let press = null;

  /** The robot under a place of the canvas. */
  function robotAt(surface, [x, y]) {
    let best = null;
    for (const robot of store.get("state")?.robots ?? []) {
      const at = robot.uv && surface.project(...robot.uv);
      const distance = at ? Math.hypot(at[0] - x, at[1] - y) : Infinity;
      if (distance < (best?.distance ?? NEAR_PX)) best = { name: robot.name, distance };
    }
    return best?.name ?? null;
  }

  function send(goals, heading = null) {
    list = [];
    const robot = store.get("chosen");
    if (!robot) return void say("Choose a robot first.", "warning");
    const goals_px = goals.slice(0, MOST_GOALS);
    void orders.send({ kind: "drive_to", robot, goals_px, ...(heading === null ? {} : { heading_rad: heading }) });
    changed();
  }

  const dragged = () => press && Math.hypot(press.now.xy[0] - press.xy[0], press.now.xy[1] - press.xy[1]) > DRAG_PX;
  const heading = () => (press.now.uv && dragged() ? Math.atan2(press.now.uv[1] - press.uv[1], press.now.uv[0] - press.uv[0]) : null);

  return {
    name: "goal",
    hint() {
      const name = store.get("chosen");
      if (!name) return "There is no robot yet.";
      if (list.length) return `${list.length} ${list.length > 1 ? "places" : "place"} for ${name}: click on, then Go, or let go of Shift.`;
      if (coarse.matches) return `Tap the ground: ${name} drives there at once. Drag to turn it in the end.`;
      return `Click the ground: ${name} drives there at once. Drag to turn it in the end. Shift-click for several. Esc rests.`;
    },
    down(event) {
      if (event.uv) press = { xy: event.xy, uv: event.uv, now: event, robot: robotAt(event.surface, event.xy) };
    },
    move(event) {
      if (press) press.now = event;
      changed();
    },
    up(event) {
      if (!press) return;
      press.now = event.uv ? event : press.now;
      const turn = heading();
      const { uv, robot } = press;
      if (robot && turn === null) choose(robot);
      else if (event.shift || several) list = [...list, uv].slice(0, MOST_GOALS);
      else send([...list, uv], turn);
      press = null;
      changed();
    },
    cancel() {
      press = null;
      changed();
    },
    /** @returns {boolean} whether there was something to forget */
    escape() {
      const had = list.length > 0 || press !== null;
      list = [];
      press = null;
      if (!had && chosenRobot()?.task !== "none") void orders.send({ kind: "rest", robot: store.get("chosen") });
      changed();
      return had;
    },
    enter() {
      if (list.length) send(list);
    },
    keyUp(key) {
      if (key === "Shift" && list.length && !several) send(list);
    },
    get several() {
      return several;
    },
    set several(on) {
      several = on;
      if (!on) list = [];
      changed();
    },
    get pending() {
      return list.length;
    },
    draw(g, surface) {
      const colour = colourOf(store.get("chosen"));
      list.forEach((uv, index) => drawGoal(g, surface, uv, colour, String(index + 1), true));
      if (!press || press.robot) return;
      drawGoal(g, surface, press.uv, colour, "", true);
      const from = surface.project(...press.uv);
      const to = press.now.uv && surface.project(...press.now.uv);
      if (dragged() && from && to) arrow(g, from, to, colour, 3, 14);
    },
  };
}
