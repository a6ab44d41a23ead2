/** Draw a path by hand; see what becomes of it; drag it right; let it be driven. */

import { toSegment } from "../geometry.js";
import { disc, stroke, trace } from "../overlay/draw.js";
import { colourOf } from "../overlay/robots.js";
import { drivable, pathOf, store } from "../store.js";

const MOST_POINTS = 4000; // what the server takes
const STEP_PX = 1.5; // raw pixels between samples: less is the mouse's grain
const GRAB_PX = 14;
const GRAB_TOUCH_PX = 26;
const SOFT_PX = 110; // how far along the line, on the screen, a pull is felt
const BEND_POINTS = 400; // of a line that is pulled: enough for its shape

export function sketchTool({ orders, changed, say }) {
  let drawing = null; // raw pixels, while the pen is down
  let pulling = null; // {line, along, at, from, by}
  let waiting = null; // {robot, sketch, points}: sent, its path is not back yet
  let hover = null;

  /** Numbers grow from the newest that anybody sent, so that the newest wins. */
  const nextNumber = (robot) => Math.max(store.get("paths")?.get(robot)?.sketch ?? 0, waiting?.robot === robot ? waiting.sketch : 0, store.get("discarded")?.get(robot) ?? 0) + 1;

  async function send(points) {
    const robot = store.get("chosen");
    if (!robot) return void say("Choose a robot first.", "warning");
    const sketch = nextNumber(robot);
    waiting = { robot, sketch, points };
    changed();
    const reply = await orders.send({ kind: "sketch", robot, sketch, points_px: points });
    if (!reply.ok && waiting?.sketch === sketch) waiting = null;
    changed();
  }

  /** What can be pulled: the path that came back, or the drawing itself where nothing of it could be driven. */
  function line() {
    const path = pathOf(store.get("chosen"));
    if (waiting?.robot === store.get("chosen") && !(path?.sketch >= waiting.sketch)) return waiting.points;
    if (!path || path.released) return null;
    if (path.points.length > 1) return path.points.map(([u, v]) => [u, v]);
    return waiting?.robot === path.robot && waiting.sketch === path.sketch ? waiting.points : null;
  }

  function grab(event, points) {
    const near = event.touch ? GRAB_TOUCH_PX : GRAB_PX;
    const seen = points.map(([u, v]) => event.surface.project(u, v));
    let best = null;
    for (let k = 1; k < seen.length; k++) {
      if (!seen[k] || !seen[k - 1]) continue;
      const { distance, at } = toSegment(event.xy, seen[k - 1], seen[k]);
      if (distance < (best?.distance ?? near)) best = { distance, index: at > 0.5 ? k : k - 1, at: seen[at > 0.5 ? k : k - 1] };
    }
    return best;
  }

  /** Even points by their way along the line: a pull falls off over distance, whatever the sampling. */
  function thinned(points) {
    const every = Math.max(Math.ceil(points.length / BEND_POINTS), 1);
    return points.filter((_, k) => k % every === 0 || k === points.length - 1);
  }

  function begin(event) {
    const points = line();
    const base = points && thinned(points);
    const found = base && grab(event, base);
    if (!found) return false;
    const seen = base.map(([u, v]) => event.surface.project(u, v) ?? [1e9, 1e9]);
    const along = [0];
    for (let k = 1; k < seen.length; k++) along.push(along[k - 1] + Math.hypot(seen[k][0] - seen[k - 1][0], seen[k][1] - seen[k - 1][1]));
    pulling = { base, along, index: found.index, from: event.uv, by: [0, 0] };
    return true;
  }

  function pulled() {
    const { base, along, index, by } = pulling;
    return base.map(([u, v], k) => {
      const far = Math.abs(along[k] - along[index]) / SOFT_PX;
      const share = far < 1 ? 0.5 * (1 + Math.cos(Math.PI * far)) : 0;
      return [u + share * by[0], v + share * by[1]];
    });
  }

  function add(points) {
    for (const uv of points) {
      const last = drawing.at(-1);
      if (!last || Math.hypot(uv[0] - last[0], uv[1] - last[1]) >= STEP_PX) drawing.push(uv);
    }
    // Longer than can be sent: every other point goes, the shape stays.
    if (drawing.length > MOST_POINTS) drawing = drawing.filter((_, k) => k % 2 === 0);
  }

  return {
    name: "sketch",
    pen: true,
    hint() {
      const name = store.get("chosen");
      if (!name) return "There is no robot yet.";
      const path = pathOf(name);
      if (path && !path.released) return "";
      return `Draw a path for ${name}: it is smoothed and shown first, nothing moves. Pull a line to bend it.`;
    },
    down(event) {
      if (!event.uv || begin(event)) return;
      drawing = [event.uv];
      changed();
    },
    move(event) {
      if (pulling && event.uv) pulling.by = [event.uv[0] - pulling.from[0], event.uv[1] - pulling.from[1]];
      else if (drawing) add(event.points);
      changed();
    },
    up(event) {
      if (pulling) {
        const moved = Math.hypot(...pulling.by) > 1;
        const points = pulled();
        pulling = null;
        if (moved) void send(points);
      } else if (drawing) {
        if (event.uv) add([event.uv]);
        const points = drawing;
        drawing = null;
        if (points.length > 3) void send(points);
        else say("That was too short for a path: draw a line.", "warning");
      }
      changed();
    },
    hover(event) {
      const points = line();
      const found = points && event.uv ? grab(event, thinned(points)) : null;
      hover = found ? { at: found.at, surface: event.surface } : null;
      changed();
    },
    cancel() {
      drawing = pulling = null;
      changed();
    },
    escape() {
      const had = drawing !== null || pulling !== null;
      drawing = pulling = null;
      changed();
      return had;
    },
    enter() {
      const path = pathOf(store.get("chosen"));
      if (path && drivable(path) && !path.released) this.drive();
    },
    /** Let the robot drive what is shown. */
    drive() {
      const path = pathOf(store.get("chosen"));
      if (path) void orders.send({ kind: "follow_path", robot: path.robot, sketch: path.sketch });
    },
    /** Forget what is shown; a robot that drives it comes to rest. */
    discard() {
      const path = pathOf(store.get("chosen"));
      if (!path) return;
      store.set("discarded", new Map(store.get("discarded")).set(path.robot, path.sketch));
      waiting = null;
      if (path.released) void orders.send({ kind: "rest", robot: path.robot });
      changed();
    },
    /** Whether a path is being made for the chosen robot. */
    get busy() {
      return waiting?.robot === store.get("chosen") && !(store.get("paths")?.get(waiting.robot)?.sketch >= waiting.sketch);
    },
    draw(g, surface) {
      const points = pulling ? pulled() : drawing ?? (this.busy ? waiting.points : null);
      if (points) {
        trace(g, surface, points);
        stroke(g, drawing || pulling ? "#fff" : colourOf(store.get("chosen")), 3, { dash: drawing ? [] : [3, 7] });
      }
      if (hover && !drawing && !pulling && hover.surface === surface) disc(g, hover.at, 7, "#fff");
    },
  };
}
