/** Areas to stay inside or to keep out of: click corners, drag them, delete them. */

import { FENCE, KEEP_OUT } from "../colours.js";
import { disc, stroke, trace } from "../overlay/draw.js";
import { polygonAt } from "../overlay/ground.js";
import { store } from "../store.js";

const NEAR_PX = 13;
const NEAR_TOUCH_PX = 24;
const DOUBLE_MS = 400;
const MOST_CORNERS = 100;
const MOST_POLYGONS = 40;

const empty = { stay_inside: [], keep_out: [] };
const copy = (fences) => ({ stay_inside: fences.stay_inside.map((p) => p.map((c) => [...c])), keep_out: fences.keep_out.map((p) => p.map((c) => [...c])) });

/** Fences as shown: what is being edited before what the server said. */
export function makeFences({ orders, changed }) {
  let edited = null;
  store.on(["fences"], () => {
    edited = null;
    changed();
  });
  return {
    get: () => edited ?? store.get("fences") ?? empty,
    /** Show at once, without sending. */
    preview(fences) {
      edited = fences;
      changed();
    },
    revert() {
      edited = null;
      changed();
    },
    async send(fences) {
      edited = fences;
      changed();
      const reply = await orders.send({ kind: "set_fences", ...fences });
      if (!reply.ok) this.revert();
    },
  };
}

/** @param {"stay_inside"|"keep_out"} kind */
export function polygonTool({ kind, name, fences, changed, say }) {
  const colour = kind === "stay_inside" ? FENCE : KEEP_OUT;
  const word = kind === "stay_inside" ? "area to stay inside" : "area to keep out of";
  let corners = [];
  let drag = null;
  let chosen = -1;
  let clicked = { at: 0, xy: [0, 0] };
  let pointer = null;

  const near = (event, uv) => {
    const at = event.surface.project(...uv);
    return at && Math.hypot(at[0] - event.xy[0], at[1] - event.xy[1]) < (event.touch ? NEAR_TOUCH_PX : NEAR_PX);
  };
  const middle = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];

  /** Corner or middle of a side under the pointer. */
  function handleAt(event) {
    const all = fences.get()[kind];
    for (let index = all.length - 1; index >= 0; index--) {
      const corner = all[index].findIndex((uv) => near(event, uv));
      if (corner >= 0) return { index, corner, insert: false };
    }
    const own = all[chosen];
    const side = own ? own.findIndex((uv, k) => near(event, middle(uv, own[(k + 1) % own.length]))) : -1;
    return side >= 0 ? { index: chosen, corner: side + 1, insert: true } : null;
  }

  function close() {
    if (corners.length < 3) return void say("An area needs three corners or more.", "warning");
    const now = copy(fences.get());
    now[kind].push(corners);
    corners = [];
    chosen = now[kind].length - 1;
    void fences.send(now);
    changed();
  }

  return {
    name,
    kind,
    hint() {
      if (corners.length > 2) return "Close it by Enter, a double click, or its first corner. Esc forgets it.";
      if (corners.length) return `${corners.length} of at least 3 corners. Esc forgets them.`;
      if (chosen >= 0) return "Drag corners, or the middle of a side for a new one. Delete removes the area.";
      return `Click the corners of an ${word}. Click inside one to change it.`;
    },
    down(event) {
      if (!event.uv) return;
      if (!corners.length) {
        const handle = handleAt(event);
        if (handle) {
          const now = copy(fences.get());
          if (handle.insert) now[kind][handle.index].splice(handle.corner, 0, event.uv);
          drag = { ...handle, now, moved: handle.insert };
          chosen = handle.index;
          changed();
        }
      }
    },
    move(event) {
      pointer = event.uv;
      if (drag && event.uv) {
        drag.now[kind][drag.index][drag.corner] = event.uv;
        drag.moved = true;
        fences.preview(drag.now);
      }
      changed();
    },
    hover(event) {
      pointer = event.uv;
      if (corners.length) changed();
    },
    up(event) {
      if (drag) {
        const { now, moved } = drag;
        drag = null;
        if (moved) void fences.send(now);
        return void changed();
      }
      if (!event.uv) return;
      const twice = performance.now() - clicked.at < DOUBLE_MS && Math.hypot(event.xy[0] - clicked.xy[0], event.xy[1] - clicked.xy[1]) < 6;
      clicked = { at: performance.now(), xy: event.xy };
      if (corners.length > 2 && (twice || near(event, corners[0]))) return void close();
      if (twice && corners.length) return;
      if (!corners.length) {
        const inside = polygonAt(event.uv, fences.get()[kind]);
        if (inside >= 0 && inside !== chosen) {
          chosen = inside;
          return void changed();
        }
        if (fences.get()[kind].length >= MOST_POLYGONS) return void say(`There are ${MOST_POLYGONS} areas already.`, "warning");
      }
      chosen = -1;
      if (corners.length < MOST_CORNERS) corners = [...corners, event.uv];
      changed();
    },
    cancel() {
      if (drag) fences.revert();
      drag = null;
      changed();
    },
    escape() {
      const had = corners.length > 0 || drag !== null || chosen >= 0;
      corners = [];
      chosen = -1;
      this.cancel();
      return had;
    },
    enter() {
      if (corners.length) close();
    },
    leave() {
      corners = [];
      chosen = -1;
    },
    remove() {
      if (chosen < 0) return;
      const now = copy(fences.get());
      now[kind].splice(chosen, 1);
      chosen = -1;
      void fences.send(now);
    },
    get open() {
      return corners.length;
    },
    get marked() {
      return chosen >= 0 && chosen < fences.get()[kind].length ? { kind, index: chosen } : null;
    },
    draw(g, surface) {
      fences.get()[kind].forEach((polygon, index) => {
        for (const uv of polygon) handle(g, surface, uv, index === chosen ? 6 : 4.5, colour);
        if (index !== chosen) return;
        polygon.forEach((uv, k) => handle(g, surface, middle(uv, polygon[(k + 1) % polygon.length]), 3.5, "#fff"));
      });
      if (!corners.length) return;
      trace(g, surface, pointer ? [...corners, pointer] : corners);
      stroke(g, colour, 2.5, { dash: [8, 5] });
      corners.forEach((uv, k) => handle(g, surface, uv, k === 0 ? 7 : 5, k === 0 ? "#fff" : colour));
    },
  };
}

function handle(g, surface, uv, radius, colour) {
  const at = surface.project(...uv);
  if (at) disc(g, at, radius, colour);
}
