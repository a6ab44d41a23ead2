/** The line below the image: what the tool does, what is known of a path, and the buttons that belong to it. */

import { byId, setAttribute, setText, show } from "../dom.js";
import { part } from "../loop.js";
import { drivable, pathOf, store } from "../store.js";
import { distance, pixels } from "../units.js";

function pathLine(path) {
  if (path.undrivable.length) {
    const [why] = path.undrivable[0];
    const more = path.undrivable.length > 1 ? ` and ${path.undrivable.length - 1} more` : "";
    return `Cannot be driven: ${why}${more}. Draw it anew, or pull the red part.`;
  }
  if (path.points.length < 2) return "Nothing of this can be driven.";
  const speeds = path.points.map((point) => point[2]);
  const fastest = Math.max(...speeds);
  const mean = path.duration_s > 0 ? path.length_m / path.duration_s : 0;
  return `${distance(path.length_m)} in ${path.duration_s.toFixed(1)} s · ${mean.toFixed(2)} m/s on average, ${fastest.toFixed(2)} at most · within ${pixels(path.deviation_px)} of your line`;
}

/** What a tool that needs to know the ground waits for; empty where it is known. */
function waits(tool) {
  const calibration = store.get("calibration");
  if (!calibration || !["goal", "sketch"].includes(tool)) return "";
  if (calibration.phase !== "off") return "Robots go to places when the calibration drive is over.";
  if (calibration.status !== "calibrated") return "Robots go to places when the camera is calibrated. Until then they can be driven by hand.";
  return "";
}

/** @param {{tools: object}} parts */
export function contextLine({ tools }) {
  const { goal, sketch } = tools.all;
  const polygon = () => (tools.edits ? tools.current : null);

  const draw = part(() => {
    const name = tools.current.name;
    const path = name === "sketch" ? pathOf(store.get("chosen")) : null;
    const busy = name === "sketch" && sketch.busy;
    const info = path && !busy;
    setText(byId("hint"), busy ? "Smoothing …" : waits(name) || tools.current.hint());
    show(byId("hint"), !info || path.released);
    if (path?.released && !busy) setText(byId("hint"), "");
    show(byId("path-info"), Boolean(info));
    if (info) setText(byId("path-info"), path.released ? `Driving: ${pathLine(path)}` : pathLine(path));
    byId("path-info").classList.toggle("bad", Boolean(info) && !drivable(path));
    show(byId("hint"), !info);
    show(byId("drive-path"), Boolean(info) && !path.released);
    byId("drive-path").disabled = !info || !drivable(path);
    show(byId("discard-path"), Boolean(info));
    show(byId("goal-several"), name === "goal");
    setAttribute(byId("goal-several"), "aria-pressed", String(goal.several));
    show(byId("goal-go"), name === "goal" && goal.pending > 0);
    setText(byId("goal-go"), `Go (${goal.pending})`);
    show(byId("goal-clear"), name === "goal" && goal.pending > 0);
    const area = polygon();
    show(byId("polygon-close"), Boolean(area) && area.open > 0);
    byId("polygon-close").disabled = !area || area.open < 3;
    show(byId("polygon-delete"), Boolean(area?.marked));
  });

  byId("drive-path").addEventListener("click", () => sketch.drive());
  byId("discard-path").addEventListener("click", () => sketch.discard());
  byId("goal-several").addEventListener("click", () => (goal.several = !goal.several));
  byId("goal-go").addEventListener("click", () => goal.enter());
  byId("goal-clear").addEventListener("click", () => goal.escape());
  byId("polygon-close").addEventListener("click", () => polygon()?.enter());
  byId("polygon-delete").addEventListener("click", () => polygon()?.remove());
  store.on(["tool", "chosen", "paths", "discarded", "fences", "state", "calibration"], draw);
  draw();
  return draw;
}
