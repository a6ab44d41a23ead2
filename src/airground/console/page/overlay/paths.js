/** Paths: coloured by their speed, with numbers at some places; in red, with the reason, what cannot be driven. */

import { RED, speedColour } from "../colours.js";
import { drivable, robotInfo } from "../store.js";
import { stroke, trace } from "./draw.js";
import { colourOf } from "./robots.js";

const APART_PX = 130; // between numbers
const BINS = 14; // colours; neighbours of one colour are one stroke

/** Fastest speed that colours stand for: the robot's limit, so that one colour is one speed whatever the path. */
export function fastest(path) {
  const limit = robotInfo(path.robot)?.limits.speed_mps;
  return limit ?? Math.max(...path.points.map((point) => point[2]), 1e-3);
}

function pieces(path) {
  const most = fastest(path);
  const bin = (point) => Math.round((point[2] / most) * BINS);
  const found = [];
  let start = 0;
  for (let k = 1; k < path.points.length; k++) {
    if (bin(path.points[k]) !== bin(path.points[start]) || k === path.points.length - 1) {
      found.push({ share: bin(path.points[start]) / BINS, points: path.points.slice(start, k + 1) });
      start = k;
    }
  }
  return found;
}

/**
 * @param {{robot: string, points: number[][], undrivable: any[], released: boolean}} path
 * @param {{numbers: boolean, underWay: boolean}} options
 */
export function drawPath(g, surface, labels, path, { numbers, underWay }) {
  g.save();
  g.globalAlpha = path.released && !underWay ? 0.35 : 1;
  if (path.points.length > 1) {
    trace(g, surface, path.points);
    stroke(g, "rgba(6, 10, 14, 0.8)", 7, { halo: false });
    for (const { share, points } of pieces(path)) {
      trace(g, surface, points);
      stroke(g, speedColour(share), 4, { halo: false });
    }
  }
  for (const [, place] of path.undrivable) {
    trace(g, surface, place);
    stroke(g, RED, 6);
  }
  g.restore();
  for (const [why, place] of path.undrivable) {
    const at = place.length ? surface.project(...place[Math.floor(place.length / 2)]) : null;
    // Where it is, is seen; the line below the image says it in full.
    if (at) labels.place(why.split(": ").at(-1), at, { away: 12, colour: "#fff", fill: "rgba(150, 16, 22, 0.95)", must: true });
  }
  if (numbers && drivable(path) && (underWay || !path.released)) writeSpeeds(surface, labels, path);
}

function writeSpeeds(surface, labels, path) {
  let before = null;
  let gone = APART_PX * 0.6;
  let unit = " m/s"; // said once, at the first number
  for (const [u, v, speed] of path.points) {
    const at = surface.project(u, v);
    if (at && before) gone += Math.hypot(at[0] - before[0], at[1] - before[1]);
    before = at;
    if (at && gone >= APART_PX && labels.place(`${speed.toFixed(2)}${unit}`, at, { away: 9, font: "600 11px system-ui, sans-serif", colour: "#f2f5f7" })) {
      gone = 0;
      unit = "";
    }
  }
  const [u, v] = path.points.at(-1);
  const end = surface.project(u, v);
  if (end) labels.place(`${path.robot} ends here`, end, { away: 10, colour: colourOf(path.robot), font: "600 11px system-ui, sans-serif" });
}
