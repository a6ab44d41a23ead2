/** Who holds the controls; taking them, giving them back, and being there while holding them. */

import { byId, setAttribute, setText, show } from "./dom.js";
import { closePop, openPop } from "./popups.js";
import { holdsControls, store } from "./store.js";

/** @param {{connection: import("./connection.js").Connection, orders: object, say: Function}} parts */
export function makeControls({ connection, orders, say }) {
  const take = byId("take"), give = byId("give"), text = byId("controls-text");

  async function ask(message) {
    const reply = await connection.ask({ kind: "controls", ...message });
    if (!reply.ok) say(reply.line || "The controls were refused.", "warning");
    return reply.ok;
  }

  function wantControls() {
    const controls = store.get("controls");
    if (!controls?.holder) return void ask({ take: true });
    setText(byId("take-question"), `${controls.name || controls.holder} has the controls. Taking over stops what is being driven.`);
    openPop(byId("take-confirm"), take);
    byId("take-cancel").focus();
    return undefined;
  }

  take.addEventListener("click", wantControls);
  give.addEventListener("click", () => ask({ take: false }));
  byId("take-cancel").addEventListener("click", () => closePop());
  byId("take-force").addEventListener("click", () => {
    closePop();
    void ask({ take: true, force: true });
  });

  let held = false;
  store.on(["controls", "connection"], () => {
    const controls = store.get("controls");
    const you = holdsControls();
    const live = store.get("connection") === "live";
    const name = controls?.name || controls?.holder;
    let words = "Not connected";
    if (live && you) words = "You have the controls";
    else if (live) words = controls?.holder ? `${name} has the controls` : "Controls are free";
    setText(text, words);
    setAttribute(text, "title", words);
    setAttribute(byId("controls"), "data-holder", you ? "you" : controls?.holder ? "other" : "none");
    show(take, !you);
    show(give, you);
    take.disabled = !live;
    // That somebody else took them is told by the server; that they went with the connection is not.
    if (held && !live) say("The connection was lost, and with it the controls: what was driven stops.", "error");
    held = you && live;
  });

  // A worker's timer keeps its pace while the page is in the background; where there are no workers, the page's own.
  const alive = () => holdsControls() && orders.stream({ kind: "alive" });
  try {
    const worker = new Worker("pulse.worker.js");
    worker.onmessage = alive;
    worker.onerror = () => setInterval(alive, 200);
  } catch {
    setInterval(alive, 200);
  }

  document.addEventListener("visibilitychange", () => {
    connection.send({ kind: "view", image: !document.hidden, rate_hz: 15, width_px: store.get("imageWidth") ?? 1280 });
    if (!document.hidden || !holdsControls()) return;
    // Nobody drives what nobody sees.
    void ask({ take: false });
    say("This page was out of sight: the controls were given back, and what was driven stopped.", "warning");
  });
}
