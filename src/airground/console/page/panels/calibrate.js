/** Making the camera known: begin, see how it goes and what to do next, take the result over. */

import { byId, make, setAttribute, setText, show } from "../dom.js";
import { part } from "../loop.js";
import { store } from "../store.js";
import { percent } from "../units.js";

const PHASES = ["starting", "running", "good", "solving"];
const FROM = 1; // the bar begins at 100 %: half a speed more or less

/** How far from knowing nothing to what is wanted, in orders of magnitude: equal steps are equally hard. */
export function share(sigma, wanted) {
  if (!(sigma > 0) || !(wanted > 0)) return 0;
  return Math.min(Math.max(Math.log(FROM / sigma) / Math.log(FROM / wanted), 0), 1);
}

/** @param {{orders: object, openTab: (name: string) => void, takeTool: (name: string) => void}} parts */
export function calibratePanel({ orders, openTab, takeTool }) {
  const left = new Set(); // robots that do not take part
  const who = byId("calibration-who");

  function build() {
    who.replaceChildren(
      ...(store.get("hello")?.site.robots ?? []).map(({ name }) => {
        const button = make("button", { class: "quiet", text: name, "aria-pressed": String(!left.has(name)) });
        button.addEventListener("click", () => {
          if (!left.delete(name)) left.add(name);
          setAttribute(button, "aria-pressed", String(!left.has(name)));
        });
        return button;
      }),
    );
  }

  async function begin(by) {
    const robots = (store.get("hello")?.site.robots ?? []).map(({ name }) => name).filter((name) => !left.has(name));
    if (!robots.length) return;
    const { ok } = await orders.send({ kind: "calibrate", by, robots: left.size ? robots : [] });
    if (ok && by === "hand") takeTool("hand");
  }
  byId("calibrate-guided").addEventListener("click", () => begin("guided"));
  byId("calibrate-hand").addEventListener("click", () => begin("hand"));
  byId("calibration-keep").addEventListener("click", () => orders.send({ kind: "end_calibration", keep: true }));
  byId("calibration-discard").addEventListener("click", () => orders.send({ kind: "end_calibration", keep: false }));
  byId("invite-button").addEventListener("click", () => {
    openTab("calibrate");
    byId("calibrate-guided").focus();
  });

  const draw = part(() => {
    const calibration = store.get("calibration");
    const status = calibration?.status ?? "none";
    const phase = calibration?.phase ?? "off";
    const on = phase !== "off";
    const lines = {
      none: "The camera does not know the ground yet.",
      bumped: "The camera was moved: its calibration holds no more.",
      calibrated: `Calibrated: speeds are true to ± ${percent(1.96 * (calibration?.relative_sigma ?? NaN))}.`,
    };
    setText(byId("calibration-status"), on ? "Calibration drive under way" : lines[status]);
    show(byId("calibration-begin"), !on);
    show(byId("calibration-drive"), on);
    show(byId("invite"), Boolean(calibration) && status !== "calibrated" && !on);
    setText(byId("invite-text"), lines[status]);
    byId("tab-calibrate").classList.toggle("calls", Boolean(calibration) && status !== "calibrated" && !on);
    if (!on) return;
    const now = PHASES.indexOf(phase);
    byId("calibration-phase").dataset.phase = phase;
    [...byId("calibration-phase").children].forEach((item, k) => {
      item.className = k < now ? "past" : k === now ? "now" : "";
      if (k === now) setAttribute(item, "aria-current", "step");
      else item.removeAttribute("aria-current");
    });
    setText(byId("calibration-advice"), calibration.advice || "…");
    const done = share(calibration.live_sigma, calibration.wanted_sigma);
    byId("calibration-fill").style.transform = `scaleX(${done.toFixed(3)})`;
    const good = phase === "good" || phase === "solving";
    byId("calibration-track").classList.toggle("good", good);
    setAttribute(byId("calibration-track"), "aria-valuenow", String(Math.round(done * 100)));
    const words = `deviation ${percent(calibration.live_sigma)}`;
    setText(byId("calibration-sigma"), calibration.live_sigma === null ? "nothing known yet" : words);
    setAttribute(byId("calibration-track"), "aria-valuetext", words);
    setText(byId("calibration-wanted"), `wanted ${percent(calibration.wanted_sigma)}`);
    setText(byId("calibration-robot"), calibration.robot || "—");
    setText(byId("calibration-sightings"), String(calibration.sightings));
    byId("calibration-keep").disabled = phase !== "good";
    byId("calibration-keep").textContent = phase === "solving" ? "Solving …" : "Use it";
  });
  store.on(["calibration", "hello"], draw);
  store.on(["hello"], build);
  draw();
}
