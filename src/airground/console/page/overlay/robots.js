/** What moves: trails, where it is and how surely, where it heads, what it is called; and where it is told to go. */

import { HALO, OTHER, RED, robotColour } from "../colours.js";
import { ellipse } from "../geometry.js";
import { store } from "../store.js";
import { Trails } from "../trails.js";
import { arrow, disc, stroke, trace } from "./draw.js";

const OLD_S = 0.5;
const FADES = 8;
const STILL_MPS = 0.03; // of a robot that has nothing to do: less is the noise of its odometer

export const colourOf = (name) => robotColour((store.get("hello")?.site.robots ?? []).map((robot) => robot.name), name ?? "");

/** A fading line: a few pieces, each of one strength, are drawn much faster than a hundred. */
export function drawTrail(g, surface, trail, now, colour) {
  if (trail.length < 2) return;
  const size = Math.ceil(trail.length / FADES);
  g.save();
  for (let k = 0; k < trail.length - 1; k += size) {
    const piece = trail.slice(k, k + size + 1);
    g.globalAlpha = 0.9 * Trails.freshness(piece.at(-1).t, now);
    trace(g, surface, piece.map((one) => one.uv));
    stroke(g, colour, 2.5, { halo: false });
  }
  g.restore();
}

/** Where something is with a probability of 95 %. */
export function drawEllipse(g, surface, uv, covariance, colour) {
  if (!uv || !covariance) return;
  const { a, b, angle } = ellipse(covariance);
  if (!(a < 1e4)) return;
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const points = [];
  for (let k = 0; k <= 32; k++) {
    const [x, y] = [a * Math.cos((k * Math.PI) / 16), b * Math.sin((k * Math.PI) / 16)];
    points.push([uv[0] + x * cos - y * sin, uv[1] + x * sin + y * cos]);
  }
  trace(g, surface, points);
  stroke(g, colour, 1.4);
}

/** One of ours. */
export function drawRobot(g, surface, labels, robot, { layers, chosen, number }) {
  const at = robot.uv && surface.project(...robot.uv);
  if (!at) return;
  const colour = colourOf(robot.name);
  const lost = !(robot.seen_s <= OLD_S);
  if (layers.ellipses) drawEllipse(g, surface, robot.uv, robot.covariance, colour);
  const ahead = robot.ahead_uv && surface.project(...robot.ahead_uv);
  if (layers.arrows && ahead) arrow(g, at, ahead, colour);
  if (chosen) {
    g.beginPath();
    g.arc(at[0], at[1], 13, 0, 2 * Math.PI);
    stroke(g, "#fff", 2.5);
  }
  disc(g, at, 5.5, lost ? "rgba(60, 60, 60, 0.9)" : colour, lost ? RED : HALO, 2.5);
  labels.reserve(at[0] - 9, at[1] - 9, 18, 18);
  if (layers.names) {
    const speeds = !surface.small && Math.abs(robot.speed_mps ?? 0) >= (robot.task === "none" ? STILL_MPS : 0);
    const moving = speeds ? ` ${Math.abs(robot.speed_mps).toFixed(2)} m/s` : "";
    const held = robot.stop_reason ? " · held" : "";
    const unseen = lost && !(surface.small && held) ? " · not seen" : "";
    labels.place(`${number} ${robot.name}${lost ? unseen : moving}${held}`, at, { away: 18, colour: lost ? "#ffb3b3" : colour, must: chosen });
  }
}

/** Something else that moves. */
export function drawOther(g, surface, labels, other, layers) {
  const at = surface.project(...other.uv);
  if (!at) return;
  if (layers.ellipses) drawEllipse(g, surface, other.uv, other.covariance, OTHER);
  const ahead = other.ahead_uv && surface.project(...other.ahead_uv);
  if (layers.arrows && ahead) arrow(g, at, ahead, OTHER, 2);
  g.fillStyle = OTHER;
  g.strokeStyle = HALO;
  g.lineWidth = 2;
  g.beginPath();
  g.rect(at[0] - 5, at[1] - 5, 10, 10);
  g.fill();
  g.stroke();
  labels.reserve(at[0] - 8, at[1] - 8, 16, 16);
  if (layers.names) {
    const sure = other.speed_sigma_mps === null ? "" : ` ± ${(1.96 * other.speed_sigma_mps).toFixed(2)}`;
    const speed = surface.small || other.speed_mps === null ? "" : ` ${other.speed_mps.toFixed(2)}${sure} m/s`;
    labels.place(`${other.name}${speed}`, at, { away: 14, colour: OTHER });
  }
}

/** Where it was told to go: numbered, joined from where it is. */
export function drawGoals(g, surface, robot) {
  if (!robot.goals_px.length || robot.task === "none") return;
  const colour = colourOf(robot.name);
  trace(g, surface, [robot.uv, ...robot.goals_px]);
  g.save();
  g.globalAlpha = 0.8;
  stroke(g, colour, 1.6, { dash: [5, 7] });
  g.restore();
  robot.goals_px.forEach((goal, index) => drawGoal(g, surface, goal, colour, robot.goals_px.length > 1 ? String(index + 1) : "", false));
}

/** A place to go to. `open`: it was not sent yet. */
export function drawGoal(g, surface, uv, colour, text, open) {
  const at = surface.project(...uv);
  if (!at) return;
  disc(g, at, 10, open ? "rgba(8, 12, 16, 0.7)" : colour, open ? colour : HALO, 2.5);
  if (text) {
    g.fillStyle = open ? colour : "#06121a";
    g.font = "700 12px system-ui, sans-serif";
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillText(text, at[0], at[1] + 0.5);
  } else disc(g, at, 3.5, open ? colour : "#06121a", "transparent", 0);
}
