/** What happened: the log, and toasts for what a person should see now. */

import { byId, make, setText } from "./dom.js";
import { part } from "./loop.js";
import { store } from "./store.js";
import { clock } from "./units.js";

const MOST = 100;
const SHOWN_MS = { info: 5000, warning: 9000, error: 12000 };
const SAME_MS = 4000; // the same line again within this is counted, not repeated
const MOST_TOASTS = 3;
const FRESH_S = 3;

/** Lines that differ in their numbers only say the same: a camera that comes and goes shall not fill the page. */
const alike = (line) => line.replace(/[\d.]+/g, "#");

export function makeEvents() {
  const list = byId("events"), toasts = byId("toasts"), announcer = byId("announcer");
  /** @type {{t: number|null, level: string, line: string, robot: string, count: number}[]} newest last */
  let events = [];
  const shown = []; // {line, node, count, until, at, timer}

  const draw = part(() => {
    list.replaceChildren(
      ...[...events].reverse().map((event) =>
        make("li", { testid: "event", class: event.level },
          make("time", { text: event.t === null ? "" : clock(event.t) }),
          make("span", { class: "line", text: `${event.robot ? `${event.robot}: ` : ""}${event.line}${event.count > 1 ? ` (${event.count} times)` : ""}` }),
        ),
      ),
    );
    if (!events.length) list.append(make("li", { class: "empty", text: "Nothing has happened yet." }));
  });

  function keep(event) {
    const last = events.at(-1);
    if (last && last.line === event.line && last.robot === event.robot) last.count += 1;
    else events = [...events, { ...event, count: 1 }].slice(-MOST);
    draw();
  }

  function toast(line, level) {
    const now = performance.now();
    const same = shown.find((one) => alike(one.line) === alike(line) && now - one.at < SHOWN_MS[level]);
    if (same) {
      same.count += 1;
      same.at = now;
      setText(same.text, `${line} (${same.count} times)`);
      clearTimeout(same.timer);
      same.timer = setTimeout(() => drop(same), SHOWN_MS[level]);
      return;
    }
    const text = make("span", { text: line });
    const node = make("button", { testid: "toast", class: `toast ${level}`, "aria-label": `${line} Dismiss.` }, text, make("span", { class: "muted", text: "✕", "aria-hidden": "true" }));
    const one = { line, node, text, count: 1, at: now };
    one.timer = setTimeout(() => drop(one), SHOWN_MS[level]);
    node.addEventListener("click", () => drop(one));
    // Who reads it with the pointer on it decides when it goes.
    node.addEventListener("pointerenter", () => clearTimeout(one.timer));
    node.addEventListener("pointerleave", () => (one.timer = setTimeout(() => drop(one), 2000)));
    shown.push(one);
    toasts.append(node);
    while (shown.length > MOST_TOASTS) drop(shown[0]);
  }

  function drop(one) {
    clearTimeout(one.timer);
    one.node.remove();
    const k = shown.indexOf(one);
    if (k >= 0) shown.splice(k, 1);
  }

  let said = { line: "", at: -Infinity };
  const sessionNow = () => store.get("state")?.t ?? null;

  draw();
  return {
    /** Something of the page itself, or a refusal: shown, and kept in the log. */
    say(line, level = "info") {
      const again = said.line === line && performance.now() - said.at < SAME_MS;
      said = { line, at: performance.now() };
      keep({ t: sessionNow(), level, line, robot: "" });
      toast(line, level);
      if (!again) setText(announcer, line);
    },
    /** Only for the log. */
    log(line, level = "info") {
      keep({ t: sessionNow(), level, line, robot: "" });
    },
    /** From the session. What is old was seen by somebody else: it goes to the log only. */
    event(event) {
      keep(event);
      const now = sessionNow();
      if (now === null || event.t < now - FRESH_S) return;
      const line = `${event.robot ? `${event.robot}: ` : ""}${event.line}`;
      if (event.level !== "info") toast(line, event.level);
      setText(announcer, line);
    },
    /** Another session: its events replace those of the one before. */
    forget() {
      events = [];
      draw();
    },
    all: () => events,
  };
}
