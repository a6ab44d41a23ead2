/** STOP: on the page and on the space bar, always. It says at once that it was sent, and then whether it was heard. */

import { byId, setAttribute, setText, show } from "./dom.js";
import { holdsControls, store } from "./store.js";

const PATIENCE_MS = 300; // a stop that takes longer is not one
const AGAIN_MS = 300;
const SAID_MS = 6000;
const HOLD_MS = 600;
const coarse = window.matchMedia("(pointer: coarse)");

/** @param {{orders: object, connection: import("./connection.js").Connection, log: (line: string, level: string) => void}} parts */
export function makeStop({ orders, connection, log }) {
  const button = byId("stop"), release = byId("release"), status = byId("stop-status");
  let pending = null; // {before, at, left}: pressed, not heard yet
  let heardAt = -Infinity;
  let timer = 0;

  function press() {
    const now = performance.now();
    // Pressed again while it is not heard: sent again, but the patience runs from the first.
    pending ??= { before: store.get("state")?.stop_heard ?? 0, at: now, left: false, told: false };
    pending.left = orders.stop() || pending.left;
    clearInterval(timer);
    timer = setInterval(again, AGAIN_MS);
    setTimeout(show_, PATIENCE_MS + 20);
    navigator.vibrate?.(60);
    show_();
  }

  /** Until it is heard it is sent again; after a lost connection too, as soon as there is one. */
  function again() {
    if (!pending) return clearInterval(timer);
    pending.left = orders.stop() || pending.left;
    return show_();
  }

  function listen(state) {
    if (pending?.left && state && (state.stop_heard > pending.before || state.mode === "stopped")) {
      log(`STOP was heard after ${Math.round(performance.now() - pending.at)} ms.`, "info");
      pending = null;
      heardAt = performance.now();
      clearInterval(timer);
      setTimeout(show_, SAID_MS + 50);
    }
    show_();
  }

  function words() {
    const state = store.get("state");
    const live = store.get("connection") === "live";
    if (pending) {
      const late = performance.now() - pending.at >= PATIENCE_MS;
      if (!live) return ["unheard", "STOP NOT HEARD: there is no connection. Stop the robots by other means!"];
      if (late) return ["unheard", "STOP NOT HEARD. It is being repeated. Stop the robots by other means!"];
      return ["sent", "STOP sent …"];
    }
    if (performance.now() - heardAt < SAID_MS) return ["heard", "STOP heard, robots stand"];
    if (!live) return ["lost", "No connection: robots stop by themselves"];
    if (state?.mode === "stopped") return ["stopped", `Stopped: ${state.why || "waits for a person"}${holdsControls() ? "" : " · take the controls to release"}`];
    return ["ready", coarse.matches ? "All robots stand at once" : "Space bar: all robots stop"];
  }

  function show_() {
    const [kind, line] = words();
    if (kind === "unheard" && !pending.told) {
      pending.told = true;
      log("STOP was not heard in time.", "error");
    }
    setAttribute(status, "data-state", kind);
    setText(status, line);
    const stopped = store.get("state")?.mode === "stopped";
    show(release, stopped && !pending);
    release.disabled = !holdsControls();
    setAttribute(release, "title", holdsControls() ? "Hold for 0.6 s (or hold Enter)" : "Only who has the controls may release");
  }

  button.addEventListener("pointerdown", (event) => {
    // On the way down: a click comes only when the finger lifts, and not at all where it slipped.
    event.preventDefault();
    press();
  });
  button.addEventListener("click", (event) => {
    // By Enter, or by a screen reader; a pointer was heard already.
    if (event.detail === 0) press();
  });

  let holding = 0;
  const hold = () => {
    if (holding || release.disabled) return;
    release.classList.add("holding");
    holding = setTimeout(() => {
      letGo();
      void orders.send({ kind: "release" });
    }, HOLD_MS);
  };
  const letGo = () => {
    clearTimeout(holding);
    holding = 0;
    release.classList.remove("holding");
  };
  release.addEventListener("pointerdown", (event) => {
    release.setPointerCapture(event.pointerId);
    hold();
  });
  for (const kind of ["pointerup", "pointercancel", "blur"]) release.addEventListener(kind, letGo);
  release.addEventListener("keydown", (event) => event.key === "Enter" && hold());
  release.addEventListener("keyup", (event) => event.key === "Enter" && letGo());

  store.on(["state"], listen);
  store.on(["connection", "controls"], show_);
  // The connection has been lost for good where it is silent, which nobody announces.
  setInterval(() => pending && show_(), 100);
  show_();

  // First of all listeners, in the capture phase: whatever has the focus, the space bar is STOP and nothing else.
  window.addEventListener("keydown", (event) => {
    if (event.code !== "Space" && event.key !== " ") return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat) press();
  }, true);
  for (const kind of ["keyup", "keypress"]) {
    window.addEventListener(kind, (event) => {
      if (event.code !== "Space" && event.key !== " ") return;
      event.preventDefault();
      event.stopImmediatePropagation();
    }, true);
  }
  return { press, get pending() {
    return pending !== null;
  }, ready: () => connection.ready };
}
