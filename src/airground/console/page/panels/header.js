/** The top of the page: what the whole is doing, the line to the server, and how old what is shown is. */

import { byId, kept, make, setAttribute, setText, show } from "../dom.js";
import { part } from "../loop.js";
import { togglePop } from "../popups.js";
import { store } from "../store.js";
import { age } from "../units.js";
import { imageAge, stateAge } from "../view.js";

const OLD_S = 0.5;
const STALE_S = 1;
const MODES = { idle: "Idle", calibrating: "Calibrating", driving: "Driving", stopped: "Stopped" };

/** @param {{connection: object, view: object}} parts */
export function header({ connection, view }) {
  const { clock } = connection;
  const narrow = window.matchMedia("(max-width: 700px)");
  const wide = window.matchMedia("(min-width: 1240px)");
  const details = byId("connection-details");

  const drawMode = part(() => {
    const state = store.get("state");
    const live = store.get("connection") === "live";
    const mode = byId("mode");
    setAttribute(mode, "data-mode", live && state ? state.mode : "off");
    setText(mode, live ? (MODES[state?.mode] ?? "No state") : "Not connected");
    const camera = state && state.camera.state !== "live" ? `Camera ${state.camera.state}${state.camera.line ? `: ${state.camera.line}` : ""}` : "";
    const why = live ? state?.why || camera || state?.camera.line || "" : "";
    setText(byId("why"), why);
    setAttribute(byId("why"), "title", why);
    const recording = store.get("recording")?.file ?? "";
    show(byId("recording"), Boolean(recording));
    setAttribute(byId("recording"), "title", `Recording to ${recording}`);
    const site = store.get("hello")?.site.name ?? "";
    setText(byId("site"), site);
    document.title = site ? `${site} · airground` : "airground console";
  });

  /** Several times a second: ages grow while nothing comes. */
  const drawAges = part(() => {
    const state = store.get("connection");
    const image = imageAge(view, clock), told = stateAge(clock);
    const old = state === "live" && (image > OLD_S || told > OLD_S);
    setAttribute(byId("connection"), "data-state", old ? "old" : state);
    const trip = clock.roundTrip === null ? "—" : age(clock.roundTrip);
    let line = { connecting: "connecting", lost: "lost", refused: "closed" }[state];
    if (state === "live") {
      const shown = view.header ? `image ${age(image)}` : "no image";
      line = narrow.matches ? age(Math.max(image ?? 0, told ?? 0)) : wide.matches ? `live ${trip} · ${shown} · state ${age(told)}` : `live · ${shown}`;
    }
    setText(byId("connection-text"), line);
    setAttribute(byId("connection"), "aria-label", `Connection: ${line}`);
    stale(state, image);
    if (!details.hidden) drawDetails(trip, image, told);
  });

  let frozen = { index: -1, since: 0 };
  function stale(state, image) {
    // Without a connection there is no clock: then what counts is for how long this image has been here.
    if (view.header && view.header.index !== frozen.index) frozen = { index: view.header.index, since: performance.now() };
    const seconds = state === "live" && image !== null ? image : (performance.now() - frozen.since) / 1000;
    const bad = view.header !== null && seconds > STALE_S;
    show(byId("stale"), bad);
    view.surface.base.classList.toggle("old", bad);
    const camera = store.get("state")?.camera;
    const line = state === "live" && camera?.line ? `: ${camera.line}` : "";
    if (bad) setText(byId("stale"), `What you see is ${Math.floor(seconds)} s old${line}`);
  }

  function drawDetails(trip, image, told) {
    const state = store.get("state");
    const rows = [
      ["Round trip", trip], ["Age of the image", age(image)], ["Age of the state", age(told)],
      ["Camera", state ? `${state.camera.state}, ${state.camera.rate_hz.toFixed(1)} frames/s` : "—"],
      ["Server", store.get("hello")?.server ?? "—"],
      ["Pages open", `${store.get("controls")?.clients ?? "—"} in all`],
      ["Recording", store.get("recording")?.file || "off"],
      ...Object.entries(state?.stages_ms ?? {}).map(([name, ms]) => [`Stage ${name}`, `${ms.toFixed(1)} ms`]),
    ];
    const refused = store.get("counts");
    if (refused) rows.push(["Refused, hostile", `${refused.refused ?? 0}, ${total(refused.hostile)}`]);
    details.replaceChildren(make("dl", { class: "facts" }, ...rows.flatMap(([name, value]) => [make("dt", { text: name }), make("dd", { text: String(value) })])));
  }
  const total = (counts) => (typeof counts === "object" && counts ? Object.values(counts).reduce((a, b) => a + b, 0) : counts ?? 0);

  byId("connection").addEventListener("click", () => {
    togglePop(details, byId("connection"));
    drawAges();
  });
  byId("theme").addEventListener("click", switchTheme);
  store.on(["state", "connection", "hello", "recording"], drawMode);
  store.on(["connection"], drawAges);
  setInterval(drawAges, 200);
  drawMode();
  drawAges();
}

/** Dark or light, from now on. */
export function switchTheme() {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : !window.matchMedia("(prefers-color-scheme: light)").matches;
  root.dataset.theme = dark ? "light" : "dark";
  kept.set("theme", root.dataset.theme);
  store.set("theme", root.dataset.theme);
}
