/** What belongs to the ground: metric grid, horizon, fences, the next leg of a calibration. */

import { FENCE, KEEP_OUT } from "../colours.js";
import { distort, inPolygon } from "../geometry.js";
import { store } from "../store.js";
import { distance } from "../units.js";
import { arrow, disc, stroke, trace } from "./draw.js";

const HORIZON_POINTS = 80;
const EDGE_PIECES = 8;

/** Metric grid, as the server drew it up for this calibration. */
export function drawGrid(g, surface) {
  const grid = store.get("calibration")?.grid ?? [];
  g.save();
  g.globalAlpha = 0.45;
  for (const line of grid) {
    trace(g, surface, line.points);
    stroke(g, "#fff", line.axis ? 1.8 : 1, { halo: false });
  }
  g.restore();
}

/** How far apart the lines of the grid are; null without one. */
export const gridStep = () => {
  const step = store.get("calibration")?.step_m;
  return step ? `grid ${distance(step)}` : null;
};

/** The horizon is straight in undistorted pixels, and bent by the lens in those that are seen. */
export function drawHorizon(g, surface, labels) {
  const calibration = store.get("calibration");
  const line = calibration?.horizon;
  const [width, height] = calibration?.image_size_px ?? [0, 0];
  if (!line || !width) return;
  const [a, b, c] = line;
  const lens = calibration.rectify?.lens ?? null;
  const points = [];
  for (let k = 0; k <= HORIZON_POINTS; k++) {
    const share = (k / HORIZON_POINTS) * 1.4 - 0.2; // a lens pulls in what is beside the image
    const flat = Math.abs(b) >= Math.abs(a);
    const u = flat ? share * width : -(b * share * height + c) / a;
    const v = flat ? -(a * u + c) / b : share * height;
    points.push(distort(lens, u, v));
  }
  trace(g, surface, points);
  stroke(g, "#9ad4ff", 1.6, { dash: [10, 7] });
  const inside = points.filter((p) => p && p[0] > 0 && p[1] > 0 && p[0] < width && p[1] < height);
  const at = inside.length ? surface.project(...inside[Math.floor(inside.length * 0.12)]) : null;
  if (at) labels.place("horizon", at, { away: 6, colour: "#c5e6ff" });
}

/** A polygon's outline in short pieces: what is straight in the image is not, on ground that a lens has bent. */
function edges(polygon) {
  const found = [];
  polygon.forEach(([u, v], k) => {
    const [x, y] = polygon[(k + 1) % polygon.length];
    for (let i = 0; i < EDGE_PIECES; i++) found.push([u + ((x - u) * i) / EDGE_PIECES, v + ((y - v) * i) / EDGE_PIECES]);
  });
  return [...found, polygon[0]];
}

function hatch(g, surface, polygon, colour) {
  const seen = polygon.map((p) => surface.project(p[0], p[1]));
  if (seen.some((p) => !p)) return;
  const xs = seen.map((p) => p[0]), ys = seen.map((p) => p[1]);
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  g.save();
  trace(g, surface, polygon, true);
  g.clip();
  g.beginPath();
  const low = Math.max(x0 - (y1 - y0), -4000), high = Math.min(x1, 8000);
  for (let x = low; x < high; x += 12) {
    g.moveTo(x, y1);
    g.lineTo(x + (y1 - y0), y0);
  }
  g.globalAlpha = 0.5;
  g.strokeStyle = colour;
  g.lineWidth = 1.5;
  g.stroke();
  g.restore();
}

/** Polygons to stay inside and to keep out of: told apart by their hatching and name, not by colour alone. */
export function drawFences(g, surface, labels, fences, marked = null) {
  for (const [kind, colour, word] of [["stay_inside", FENCE, "stay inside"], ["keep_out", KEEP_OUT, "keep out"]]) {
    fences[kind].forEach((polygon, index) => {
      const on = marked?.kind === kind && marked.index === index;
      if (kind === "keep_out") hatch(g, surface, polygon, colour);
      trace(g, surface, edges(polygon));
      stroke(g, colour, on ? 3.5 : 2, { dash: kind === "stay_inside" ? [14, 5] : [] });
      const top = polygon.reduce((a, b) => (b[1] < a[1] ? b : a));
      const at = surface.project(top[0], top[1]);
      if (at) labels.place(word, at, { away: 8, colour });
    });
  }
}

/** Which polygon a raw pixel is in; the newest wins. */
export function polygonAt(uv, polygons) {
  for (let k = polygons.length - 1; k >= 0; k--) if (inPolygon(uv, polygons[k])) return k;
  return -1;
}

/** The next leg of a calibration, from where to where. */
export function drawLeg(g, surface, labels) {
  const { leg_from_px: from, leg_to_px: to, phase, robot } = store.get("calibration") ?? {};
  if (!phase || phase === "off" || !from) return;
  const a = surface.project(...from);
  const b = to ? surface.project(...to) : null;
  if (!a) return;
  if (!b) return void disc(g, a, 6, "#fff");
  arrow(g, a, b, "#ffe14d", 5, 20);
  labels.place(robot ? `${robot}: next leg` : "next leg", b, { away: 16, colour: "#ffe14d" });
}
