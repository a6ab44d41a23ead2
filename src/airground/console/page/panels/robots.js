/** Our robots: which is chosen, what each does, how well, and why it is held; its speed, and rest. */

import { byId, make, setAttribute, setText, show } from "../dom.js";
import { part } from "../loop.js";
import { colourOf } from "../overlay/robots.js";
import { robotInfo, store } from "../store.js";
import * as units from "../units.js";

const OLD_S = 0.5;
const SEND_MS = 150; // while a slider is dragged

const TASKS = { none: "stands", goal: "to its goal", to_path: "to its path", path: "on its path", hand: "by hand", leg: "calibration leg" };

function taskLine(robot) {
  if (robot.stop_reason) return "held";
  if (robot.done) return "arrived";
  if (robot.task === "path") return `path ${Math.round(robot.progress * 100)} %`;
  return TASKS[robot.task] ?? robot.task;
}

/** @param {{orders: object, choose: (name: string) => void}} parts */
export function robotsPanel({ orders, choose }) {
  const list = byId("robots");
  const cards = new Map();

  function card(info, index) {
    const mark = make("span", { class: "mark" });
    mark.style.background = colourOf(info.name);
    const task = make("span", { class: "task" });
    const speed = make("span", { class: "speed" });
    const seen = make("span", { class: "age" }), heard = make("span", { class: "age" });
    const error = make("span", { class: "off" });
    const facts = make("span", { class: "facts-line" }, make("span", {}, seen, heard), error);
    const why = make("span", { class: "why" });
    const head = make("button", { class: "head", testid: `robot-${info.name}`, "aria-pressed": "false", title: `Choose (${index + 1})` },
      mark, make("span", { class: "who" }, make("span", { class: "name", text: `${index + 1} ${info.name}` }), task), speed, facts, why);
    speed.dataset.testid = `robot-speed-${info.name}`;
    head.addEventListener("click", () => choose(info.name));

    const most = info.limits.speed_mps;
    const step = most > 2 ? 0.05 : 0.01;
    const id = `slider-${index}`;
    const label = make("label", { for: id });
    const slider = make("input", { type: "range", id, testid: `speed-${info.name}`, min: String(step), max: String(most), step: String(step), value: String(most) });
    let timer = 0;
    let until = 0; // while a hand is on it, the state does not move it
    const send = () => {
      clearTimeout(timer);
      timer = 0;
      void orders.send({ kind: "set_speed", robot: info.name, speed_mps: Number(slider.value) });
    };
    slider.addEventListener("input", () => {
      until = performance.now() + 1000;
      setText(label, `Speed up to ${units.speed(Number(slider.value))}`);
      timer ||= setTimeout(send, SEND_MS);
    });
    slider.addEventListener("change", send);
    const rest = make("button", { class: "quiet", testid: `rest-${info.name}`, text: "Rest", title: "Forget what it was to do (R)" });
    rest.addEventListener("click", () => orders.send({ kind: "rest", robot: info.name }));
    const node = make("div", { class: "robot" }, head, make("div", { class: "drawer" }, make("div", {}, label, slider), rest));
    return { node, head, task, speed, seen, heard, error, why, slider, label, held: () => performance.now() < until };
  }

  function build() {
    list.replaceChildren();
    cards.clear();
    (store.get("hello")?.site.robots ?? []).forEach((info, index) => {
      const made = card(info, index);
      cards.set(info.name, made);
      list.append(made.node);
    });
    if (!cards.size) list.append(make("p", { class: "empty", text: "This site has no robots." }));
    show(byId("rest-all"), cards.size > 1);
    draw();
  }

  const draw = part(() => {
    const chosen = store.get("chosen");
    const sigma = store.get("calibration")?.relative_sigma;
    for (const robot of store.get("state")?.robots ?? []) {
      const at = cards.get(robot.name);
      if (!at) continue;
      const on = robot.name === chosen;
      at.node.classList.toggle("chosen", on);
      setAttribute(at.head, "aria-pressed", String(on));
      setText(at.task, taskLine(robot));
      const measured = robot.speed_mps;
      const sure = typeof sigma === "number" && typeof measured === "number" ? ` ± ${(1.96 * sigma * Math.abs(measured)).toFixed(2)}` : "";
      setText(at.speed, typeof measured === "number" ? `${units.minus(measured.toFixed(2))}${sure} m/s` : "— m/s");
      const busy = robot.task !== "none" && (robot.error_m !== null || robot.error_px !== null);
      setText(at.error, busy ? `${robot.error_m === null ? "" : `${units.distance(robot.error_m)} · `}${units.pixels(robot.error_px)}` : "");
      setAttribute(at.error, "title", busy ? "Off its goal or path" : "");
      setText(at.seen, robot.seen_s === null ? "not seen" : `seen ${units.age(robot.seen_s)}`);
      setText(at.heard, robot.heard_s === null ? " · not heard" : ` · heard ${units.age(robot.heard_s)}`);
      at.seen.classList.toggle("old", !(robot.seen_s <= OLD_S));
      at.heard.classList.toggle("old", !(robot.heard_s <= OLD_S));
      setText(at.why, robot.stop);
      if (!at.held()) {
        at.slider.value = String(robot.speed_limit_mps);
        setText(at.label, `Speed up to ${units.speed(robot.speed_limit_mps)}`);
      }
    }
  });

  byId("rest-all").addEventListener("click", () => orders.send({ kind: "rest", robot: null }));
  store.on(["hello"], build);
  store.on(["state", "chosen", "calibration"], draw);
  build();
  return { known: (name) => robotInfo(name) !== null };
}
