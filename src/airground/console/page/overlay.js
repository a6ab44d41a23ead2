/** All that is drawn over a picture, from the ground up. The same for the live image and the bird's-eye view. */

import { gridStep, drawFences, drawGrid, drawHorizon, drawLeg } from "./overlay/ground.js";
import { drawPath } from "./overlay/paths.js";
import { colourOf, drawGoals, drawOther, drawRobot, drawTrail } from "./overlay/robots.js";
import { OTHER } from "./colours.js";
import { Labels } from "./labels.js";
import { pathOf, store } from "./store.js";
import { kept } from "./dom.js";

/** What can be shown or left out, with its name. */
export const LAYERS = {
  names: "Names and speeds", arrows: "Where they head", trails: "Trails of 10 s", ellipses: "95 % ellipses", goals: "Goals", paths: "Paths",
  fences: "Fences", grid: "Metric grid", horizon: "Horizon",
};

const DEFAULTS = { names: true, arrows: true, trails: true, ellipses: true, goals: true, paths: true, fences: true, grid: false, horizon: true };
store.set("layers", { ...DEFAULTS, ...kept.get("layers", {}) });

/** @param {string} name of a layer */
export function toggleLayer(name) {
  const layers = { ...store.get("layers"), [name]: !store.get("layers")[name] };
  kept.set("layers", layers);
  store.set("layers", layers);
}

/**
 * @param {import("./surface.js").Surface} surface
 * @param {{trails: import("./trails.js").Trails, tools: any, ground: Function}} parts ground draws what only this surface has, beneath all
 */
export function drawOverlay(surface, { trails, tools, ground }) {
  const g = surface.over.getContext("2d");
  const { width, height } = surface.viewport;
  g.setTransform(surface.dense, 0, 0, surface.dense, 0, 0);
  g.clearRect(0, 0, width, height);
  const labels = new Labels(g, width, height);
  for (const box of surface.covered()) labels.reserve(...box);
  const layers = store.get("layers");
  const state = store.get("state");
  ground(g, labels, layers);
  if (layers.fences || tools.edits) drawFences(g, surface, labels, tools.fences(), tools.marked);
  if (!state) return;
  if (layers.trails) {
    for (const other of state.others) drawTrail(g, surface, trails.of(`other ${other.name}`), state.t, OTHER);
    for (const robot of state.robots) drawTrail(g, surface, trails.of(robot.name), state.t, colourOf(robot.name));
  }
  const chosen = store.get("chosen");
  const paths = state.robots.map((robot) => ({ robot, path: pathOf(robot.name) })).filter(({ path }) => path);
  const underWay = (robot) => robot.task === "path" || robot.task === "to_path";
  // Robots before numbers of paths: labels that come first get the best places.
  if (layers.goals) for (const robot of state.robots) drawGoals(g, surface, robot);
  const late = waiting(labels), names = waiting(labels);
  if (layers.paths) for (const { robot, path } of paths) drawPath(g, surface, late, path, { numbers: robot.name === chosen, underWay: underWay(robot) });
  drawLeg(g, surface, late);
  tools.draw(g, surface, labels);
  for (const other of state.others) drawOther(g, surface, names, other, layers);
  state.robots.forEach((robot, index) => drawRobot(g, surface, names, robot, { layers, chosen: robot.name === chosen, number: index + 1 }));
  names.write();
  late.write();
  drawCross(g, surface);
}

/** Labels that are written when all marks are known: none shall lie over one. */
function waiting(labels) {
  const calls = [];
  return { place: (...call) => calls.push(call) > 0, reserve: (...box) => labels.reserve(...box), write: () => calls.forEach((call) => labels.place(...call)) };
}

/** What only the live image has beneath: grid and horizon of the calibration. */
export function imageGround(surface) {
  return (g, labels, layers) => {
    if (layers.grid) {
      drawGrid(g, surface);
      const step = gridStep();
      if (step) labels.place(step, [8, surface.viewport.height - 8], { away: 2 });
    }
    if (layers.horizon) drawHorizon(g, surface, labels);
  };
}

function drawCross(g, surface) {
  if (!surface.cross) return;
  const [x, y] = surface.cross;
  for (const [colour, wide] of [["rgba(6, 10, 14, 0.8)", 4], ["#fff", 1.5]]) {
    g.beginPath();
    g.moveTo(x - 16, y);
    g.lineTo(x + 16, y);
    g.moveTo(x, y - 16);
    g.lineTo(x, y + 16);
    g.strokeStyle = colour;
    g.lineWidth = wide;
    g.stroke();
  }
}
