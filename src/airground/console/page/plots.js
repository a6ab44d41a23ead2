/** Speed, turn rate and error of the chosen robot over the last half minute. */

import { part } from "./loop.js";
import { colourOf } from "./overlay/robots.js";
import { store } from "./store.js";
import { minus } from "./units.js";

const WINDOW_S = 30;
const STEP_S = 0.045; // states come up to 20 times a second
const MOST = Math.ceil(WINDOW_S / STEP_S) + 2;
const STEPS = [1, 2, 5, 10];

const given = (x) => (typeof x === "number" && Number.isFinite(x) ? x : NaN);

const PLOTS = [
  { id: "plot-speed", title: "Speed", unit: "m/s", lines: (s) => [s.speed, s.v], base: [0, 0.2] },
  { id: "plot-turn", title: "Turn rate", unit: "rad/s", lines: (s) => [s.turn, s.omega], base: [-0.2, 0.2] },
  { id: "plot-error", title: "Error", unit: "cm", lines: (s) => [s.cm], base: [0, 2] },
];

export class Plots {
  #samples = new Map();

  constructor() {
    this.canvases = PLOTS.map(({ id }) => document.getElementById(id));
    this.draw = part(() => this.#draw());
    const observer = new ResizeObserver(() => this.draw());
    for (const canvas of this.canvases) observer.observe(canvas);
    store.on(["chosen", "theme"], this.draw);
  }

  /** Take in a state. */
  add(state) {
    for (const robot of state.robots) {
      let list = this.#samples.get(robot.name);
      if (!list || (list.length && state.t < list.at(-1).t)) this.#samples.set(robot.name, (list = []));
      if (list.length && state.t - list.at(-1).t < STEP_S) continue;
      list.push({
        t: state.t, speed: given(robot.speed_mps), turn: given(robot.turn_radps), v: given(robot.command?.v), omega: given(robot.command?.omega),
        cm: given(robot.error_m) * 100, px: given(robot.error_px),
      });
      while (list.length > MOST || state.t - list[0].t > WINDOW_S + 0.5) list.shift();
    }
    this.draw();
  }

  #draw() {
    const name = store.get("chosen");
    const samples = this.#samples.get(name) ?? [];
    const style = getComputedStyle(document.documentElement);
    const ink = { text: style.getPropertyValue("--text"), muted: style.getPropertyValue("--muted"), grid: style.getPropertyValue("--grid"), line: style.getPropertyValue("--accent"), plan: style.getPropertyValue("--plot") };
    // Without a calibration there are no centimetres, but there are pixels.
    const metric = samples.some((s) => Number.isFinite(s.cm)) || !samples.some((s) => Number.isFinite(s.px));
    PLOTS.forEach((plot, k) => {
      const own = k === 2 && !metric ? { ...plot, unit: "px", lines: (s) => [s.px] } : plot;
      drawPlot(this.canvases[k], own, samples, store.get("state")?.t ?? 0, ink, name ? colourOf(name) : "");
    });
  }
}

function ticks(low, high) {
  const raw = (high - low) / 4.5;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * STEPS.find((s) => s * power >= raw - 1e-12);
  const found = [];
  for (let y = Math.ceil(low / step - 1e-9) * step; y <= high + 1e-9 * step; y += step) found.push(y);
  return { found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

function drawPlot(canvas, { title, unit, lines, base }, samples, now, ink) {
  const dense = window.devicePixelRatio || 1;
  const { clientWidth: w, clientHeight: h } = canvas;
  if (w < 60 || h < 40) return;
  if (canvas.width !== Math.round(w * dense) || canvas.height !== Math.round(h * dense)) {
    canvas.width = Math.round(w * dense);
    canvas.height = Math.round(h * dense);
  }
  const g = canvas.getContext("2d");
  g.setTransform(dense, 0, 0, dense, 0, 0);
  g.clearRect(0, 0, w, h);
  const box = { x: 46, y: 26, w: w - 58, h: h - 26 - 20 };
  let [low, high] = base; // noise at rest is not blown up to the whole height
  for (const sample of samples) {
    for (const y of lines(sample)) {
      if (!Number.isFinite(y)) continue;
      low = Math.min(low, y);
      high = Math.max(high, y);
    }
  }
  const room = 0.06 * (high - low);
  [low, high] = [low < 0 ? low - room : low, high + room];
  const x = (t) => box.x + box.w * (1 - (now - t) / WINDOW_S);
  const y = (value) => box.y + box.h * (1 - (value - low) / (high - low));

  g.font = "11px system-ui, sans-serif";
  g.textBaseline = "middle";
  g.textAlign = "right";
  g.lineWidth = 1;
  const { found, digits } = ticks(low, high);
  for (const value of found) {
    g.strokeStyle = ink.grid;
    g.beginPath();
    g.moveTo(box.x, y(value));
    g.lineTo(box.x + box.w, y(value));
    g.stroke();
    g.fillStyle = ink.muted;
    g.fillText(minus(value.toFixed(digits)), box.x - 6, y(value));
  }
  for (const [ago, align] of [[30, "left"], [20, "center"], [10, "center"], [0, "right"]]) {
    g.textAlign = align;
    g.fillText(ago ? `−${ago}${ago === 30 ? " s" : ""}` : "now", x(now - ago), box.y + box.h + 11);
  }
  g.save();
  g.beginPath();
  g.rect(box.x, box.y - 2, box.w, box.h + 4);
  g.clip();
  const series = samples.length ? lines(samples[0]).length : 0;
  for (let k = 0; k < series; k++) {
    g.beginPath();
    let pen = false;
    for (const sample of samples) {
      const value = lines(sample)[k];
      if (!Number.isFinite(value)) pen = false;
      else if (pen) g.lineTo(x(sample.t), y(value));
      else {
        g.moveTo(x(sample.t), y(value));
        pen = true;
      }
    }
    g.setLineDash(k ? [4, 3] : []);
    g.strokeStyle = k ? ink.plan : ink.line;
    g.lineWidth = k ? 1.4 : 2;
    g.lineJoin = "round";
    g.stroke();
  }
  g.restore();
  drawTitle(g, w, title, unit, series > 1 || title !== "Error", ink);
}

function drawTitle(g, w, title, unit, both, ink) {
  g.textAlign = "left";
  g.textBaseline = "middle";
  g.fillStyle = ink.text;
  g.font = "600 12px system-ui, sans-serif";
  const text = `${title} [${unit}]`;
  g.fillText(text, 10, 13);
  if (!both) return;
  const used = 10 + g.measureText(text).width;
  g.font = "11px system-ui, sans-serif";
  const parts = [["seen", ink.line, []], ["told", ink.plan, [4, 3]]];
  const need = parts.reduce((sum, [word]) => sum + g.measureText(word).width + 30, 0);
  if (used + need + 10 > w) return;
  let at = w - 10;
  for (const [word, colour, dash] of parts.reverse()) {
    at -= g.measureText(word).width;
    g.fillStyle = ink.muted;
    g.fillText(word, at, 13);
    g.setLineDash(dash);
    g.strokeStyle = colour;
    g.lineWidth = 2;
    g.beginPath();
    g.moveTo(at - 20, 13);
    g.lineTo(at - 5, 13);
    g.stroke();
    g.setLineDash([]);
    at -= 30;
  }
}
