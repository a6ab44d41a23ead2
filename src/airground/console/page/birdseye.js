/** The ground as seen from straight above: each pixel's ground point, its place in the image, the image's colour there. */

import { GroundMap } from "./geometry.js";
import { part } from "./loop.js";
import { drawOverlay } from "./overlay.js";
import { rectifier } from "./rectifier.js";
import { store } from "./store.js";
import { Surface } from "./surface.js";
import { distance } from "./units.js";

const LINE_APART_PX = 46; // at least, between metre lines

export class BirdsEye {
  /** @param {object} parts trails, tools */
  constructor(parts) {
    this.map = null;
    this.note = document.getElementById("bird-note");
    this.base = document.getElementById("bird");
    this.rectify = rectifier(this.base);
    this.drawImage = part(() => this.#image());
    this.drawOverlay = part(() => drawOverlay(this.surface, { ...parts, ground: (g, labels) => this.#grid(g, labels) }));
    this.surface = new Surface({
      name: "ground",
      base: this.base,
      over: document.getElementById("bird-overlay"),
      project: (u, v) => this.map?.ground(u, v) ?? null,
      unproject: (x, y) => this.map?.image(x, y) ?? null,
      changed: (what) => {
        if (what !== "hover") this.drawImage();
        this.drawOverlay();
      },
    });
    store.on(["calibration"], (calibration) => this.#calibrated(calibration));
    this.#say();
  }

  #calibrated(calibration) {
    const { rectify, image_size_px: size } = calibration ?? {};
    this.map = rectify?.ground_from_image && size ? new GroundMap(rectify, size) : null;
    this.size = size;
    if (this.map) {
      const [x0, y0, x1, y1] = this.map.bounds;
      this.surface.viewport.setContent(x0, y0, x1 - x0, y1 - y0, { up: true, home: this.map.near(size) });
    }
    this.#say();
    this.drawImage();
    this.drawOverlay();
  }

  #say() {
    let line = "";
    if (!this.map) line = "The view from above needs a calibration.";
    else if (!this.rectify) line = "This browser has no WebGL2: the view from above has lines only.";
    this.note.textContent = line;
  }

  /** A new image of the camera. */
  take(bitmap) {
    if (!this.map || !this.rectify) return;
    this.rectify.upload(bitmap);
    this.drawImage();
  }

  #image() {
    const { viewport, dense } = this.surface;
    this.rectify?.draw(this.map, this.size, viewport, dense);
  }

  #grid(g, labels) {
    if (!this.map) return;
    const { viewport } = this.surface;
    const step = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200].find((s) => s * viewport.scale >= LINE_APART_PX) ?? 500;
    const [x0, y1] = viewport.toContent(0, 0);
    const [x1, y0] = viewport.toContent(viewport.width, viewport.height);
    g.save();
    g.beginPath();
    for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) {
      const [sx] = viewport.toScreen(x, 0);
      g.moveTo(sx, 0);
      g.lineTo(sx, viewport.height);
    }
    for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) {
      const [, sy] = viewport.toScreen(0, y);
      g.moveTo(0, sy);
      g.lineTo(viewport.width, sy);
    }
    g.strokeStyle = "rgba(255, 255, 255, 0.3)";
    g.lineWidth = 1;
    g.stroke();
    g.restore();
    labels.place(`lines every ${distance(step).replace(/\.0+(?= )/, "").replace(/(\.\d)0 /, "$1 ")}`, [6, viewport.height - 6], { away: 2, font: "600 11px system-ui, sans-serif" });
  }
}
