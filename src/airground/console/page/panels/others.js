/** Everything else that moves in view: how fast, and how surely that is known. */

import { byId, kept, make, setText, show } from "../dom.js";
import { part } from "../loop.js";
import { store } from "../store.js";

const MOST = 30;
const KMH = 3.6;

export function othersPanel() {
  const list = byId("others");
  const rows = new Map();
  const empty = make("p", { class: "empty", text: "Nothing else moves." });
  let kmh = kept.get("kmh", false);
  list.append(empty);

  function row(name) {
    const unit = make("button", { class: "unit", title: "m/s or km/h" });
    unit.addEventListener("click", () => {
      kmh = !kmh;
      kept.set("kmh", kmh);
      draw();
    });
    const node = make("div", { class: "other", testid: `other-${name}` }, make("span", { class: "clip", text: name }), unit);
    list.append(node);
    return { node, unit };
  }

  const draw = part(() => {
    const others = (store.get("state")?.others ?? []).slice(0, MOST);
    const names = new Set(others.map((other) => other.name));
    for (const [name, { node }] of rows) {
      if (names.has(name)) continue;
      node.remove();
      rows.delete(name);
    }
    for (const other of others) {
      if (!rows.has(other.name)) rows.set(other.name, row(other.name));
      const { unit } = rows.get(other.name);
      const text = (x, by, word) => {
        const sure = other.speed_sigma_mps === null ? "" : ` ± ${(1.96 * other.speed_sigma_mps * by).toFixed(by > 1 ? 1 : 2)}`;
        return `${(x * by).toFixed(by > 1 ? 1 : 2)}${sure} ${word}`;
      };
      const known = other.speed_mps !== null;
      setText(unit, known ? (kmh ? text(other.speed_mps, KMH, "km/h") : text(other.speed_mps, 1, "m/s")) : "speed not known");
      unit.title = known ? (kmh ? text(other.speed_mps, 1, "m/s") : text(other.speed_mps, KMH, "km/h")) : "Calibrate to know speeds";
    }
    show(empty, !others.length);
  });
  store.on(["state"], draw);
}
