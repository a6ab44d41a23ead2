/**
 * A picture that can be looked at closely and worked on: canvases, zoom, pinch, pan, and the pointer in raw pixels of the image.
 * Both the live image and the bird's-eye view are one; so every tool works on both.
 */

import { Viewport } from "./viewport.js";

const STEP_PX = 12; // of the cross that the arrow keys move
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Surface {
  viewport = new Viewport();
  /** Where the keyboard's cross is, in CSS pixels; null while it is not used. */
  cross = null;
  /** Where the pointer is, in CSS pixels; null where it is elsewhere. */
  hover = null;
  #pointers = new Map();
  #mode = "none"; // none, tool, pan, pinch
  #pinch = null;
  #crossDown = false;

  /**
   * @param {{base: HTMLCanvasElement, over: HTMLCanvasElement, project: Function, unproject: Function, draw: Function, changed: Function}} options
   *   project and unproject map raw pixels to picture units and back; either may give null
   */
  constructor(options) {
    this.options = options;
    this.base = options.base;
    this.over = options.over;
    /** @type {{down: Function, move: Function, up: Function, cancel: Function, hover: Function}|null} */
    this.tool = null;
    new ResizeObserver(() => this.#resize()).observe(this.base.parentElement);
    this.#resize();
    this.#listen();
  }

  get name() {
    return this.options.name;
  }

  /** Whether there is room for names only. */
  get small() {
    return this.viewport.width < 480;
  }

  /** Places on the canvas where something of the page lies over it [CSS px]: no text is to be written there. */
  covered() {
    const box = this.base.getBoundingClientRect();
    const found = [];
    for (const node of document.querySelectorAll("#swap, .corner, #stick, #stale, #invite, #bird-note")) {
      if (node.hidden) continue;
      const at = node.getBoundingClientRect();
      if (at.width && at.height && at.right > box.left && at.left < box.right && at.bottom > box.top && at.top < box.bottom) found.push([at.left - box.left, at.top - box.top, at.width, at.height]);
    }
    return found;
  }

  /** Where a raw pixel is on the canvas [CSS px]; null where it is not to be seen. */
  project = (u, v) => {
    const at = this.options.project(u, v);
    return at && this.viewport.toScreen(at[0], at[1]);
  };

  /** Raw pixel under a place on the canvas; null where there is none. */
  unproject = (x, y) => {
    const at = this.viewport.toContent(x, y);
    return this.viewport.contains(at) ? this.options.unproject(at[0], at[1]) : null;
  };

  #resize() {
    const { width, height } = this.base.parentElement.getBoundingClientRect();
    if (width < 1 || height < 1) return;
    const dense = window.devicePixelRatio || 1;
    for (const canvas of [this.base, this.over]) {
      canvas.width = Math.round(width * dense);
      canvas.height = Math.round(height * dense);
    }
    this.dense = dense;
    this.viewport.resize(width, height);
    this.options.changed("size");
  }

  zoom(factor, x = this.viewport.width / 2, y = this.viewport.height / 2) {
    this.viewport.zoomAt(x, y, factor);
    this.options.changed("zoom");
  }

  fit() {
    this.viewport.fit();
    this.options.changed("zoom");
  }

  #listen() {
    const { base } = this;
    base.addEventListener("pointerdown", (event) => this.#down(event));
    base.addEventListener("pointermove", (event) => this.#move(event));
    base.addEventListener("pointerup", (event) => this.#up(event, false));
    base.addEventListener("pointercancel", (event) => this.#up(event, true));
    base.addEventListener("pointerleave", () => this.#hovers(null));
    base.addEventListener("contextmenu", (event) => event.preventDefault());
    base.addEventListener("dblclick", (event) => event.preventDefault());
    base.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    base.addEventListener("keydown", (event) => this.#key(event));
    base.addEventListener("blur", () => this.#dropCross());
  }

  #at(event) {
    const box = this.base.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** What tools are given. */
  #report(xy, event, more = {}) {
    return { xy, uv: this.unproject(xy[0], xy[1]), shift: event.shiftKey, touch: event.pointerType === "touch", surface: this, ...more };
  }

  #hovers(xy) {
    this.hover = xy;
    this.options.changed("hover");
  }

  #down(event) {
    this.base.focus({ preventScroll: true });
    const xy = this.#at(event);
    this.#dropCross();
    this.#pointers.set(event.pointerId, xy);
    this.base.setPointerCapture(event.pointerId);
    if (this.#pointers.size === 2) {
      // A second finger: the first did not mean to draw.
      if (this.#mode === "tool") this.tool?.cancel();
      this.#mode = "pinch";
      this.#pinch = this.#spread();
    } else if (this.#pointers.size === 1) {
      const pan = event.button === 1 || event.button === 2 || event.altKey;
      this.#mode = pan ? "pan" : "tool";
      this.base.classList.toggle("panning", pan);
      if (!pan) this.tool?.down(this.#report(xy, event));
    }
    event.preventDefault();
  }

  #move(event) {
    const xy = this.#at(event);
    if (event.pointerType !== "touch") this.#hovers(xy);
    const before = this.#pointers.get(event.pointerId);
    if (!before) {
      this.tool?.hover?.(this.#report(xy, event));
      return;
    }
    this.#pointers.set(event.pointerId, xy);
    if (this.#mode === "pan") {
      this.viewport.pan(xy[0] - before[0], xy[1] - before[1]);
      this.options.changed("zoom");
    } else if (this.#mode === "pinch") {
      const now = this.#spread();
      this.viewport.pan(now.x - this.#pinch.x, now.y - this.#pinch.y);
      this.viewport.zoomAt(now.x, now.y, now.apart / Math.max(this.#pinch.apart, 1));
      this.#pinch = now;
      this.options.changed("zoom");
    } else if (this.#mode === "tool") {
      // All samples of a quick hand, not one per frame.
      const all = event.getCoalescedEvents?.() ?? [];
      const points = (all.length ? all : [event]).map((one) => this.unproject(...this.#at(one))).filter(Boolean);
      this.tool?.move(this.#report(xy, event, { points }));
    }
  }

  #up(event, lost) {
    const known = this.#pointers.delete(event.pointerId);
    if (!known) return;
    if (this.#mode === "tool") {
      if (lost) this.tool?.cancel();
      else this.tool?.up(this.#report(this.#at(event), event));
    }
    if (this.#mode === "pinch" && this.#pointers.size > 0) this.#pinch = this.#spread();
    if (this.#pointers.size === 0) this.#mode = "none";
    this.base.classList.remove("panning");
  }

  #spread() {
    const [a, b = a] = [...this.#pointers.values()];
    return { x: (a[0] + b[0]) / 2, y: (a[1] + b[1]) / 2, apart: Math.hypot(a[0] - b[0], a[1] - b[1]) || 1 };
  }

  #wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 18 : 1;
    this.zoom(Math.exp(-event.deltaY * lines * 0.0016), ...this.#at(event));
  }

  /** Arrow keys move a cross, Enter presses there; so every tool works without a pointer. */
  #key(event) {
    if (event.ctrlKey || event.metaKey || event.defaultPrevented) return;
    const step = ARROWS[event.key];
    if (step) {
      const long = event.altKey ? 1 : STEP_PX;
      const [x, y] = this.cross ?? [this.viewport.width / 2, this.viewport.height / 2];
      const hold = (value, most) => Math.min(Math.max(value, 0), most - 1);
      this.cross = [hold(x + step[0] * long, this.viewport.width), hold(y + step[1] * long, this.viewport.height)];
      const report = this.#report(this.cross, event);
      if (this.#crossDown) this.tool?.move({ ...report, points: report.uv ? [report.uv] : [] });
      else this.tool?.hover?.(report);
      this.options.changed("hover");
      event.preventDefault();
    } else if (event.key === "Enter" && this.cross) {
      const report = this.#report(this.cross, event);
      if (this.#crossDown) {
        this.#crossDown = false;
        this.tool?.up(report);
      } else {
        this.tool?.down(report);
        // A pen stays down until the next Enter; whatever else wants a click is let go at once.
        if (this.tool?.pen) this.#crossDown = true;
        else this.tool?.up(report);
      }
      event.preventDefault();
      event.stopPropagation();
    }
  }

  #dropCross() {
    if (this.#crossDown) this.tool?.cancel();
    this.#crossDown = false;
    if (this.cross) {
      this.cross = null;
      this.options.changed("hover");
    }
  }
}
