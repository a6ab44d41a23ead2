/** The live image: the newest one, drawn where the viewport says. */

import { drawOverlay, imageGround } from "./overlay.js";
import { part } from "./loop.js";
import { store } from "./store.js";
import { Surface } from "./surface.js";

const OFFER_PX = [640, 960, 1280, 1920, 2560]; // widths to ask for: not a new one for every pixel of a resized window

export class View {
  /** @param {object} parts trails, tools */
  constructor(parts) {
    this.bitmap = null;
    this.header = null;
    this.drawImage = part(() => this.#image());
    this.drawOverlay = part(() => drawOverlay(this.surface, { ...parts, ground: this.ground }));
    this.surface = new Surface({
      name: "image",
      base: document.getElementById("view"),
      over: document.getElementById("view-overlay"),
      project: (u, v) => [u, v],
      unproject: (u, v) => [u, v],
      changed: (what) => {
        if (what !== "hover") this.drawImage();
        this.drawOverlay();
        if (what === "size") this.onSize?.();
        if (what === "zoom") this.onZoom?.();
      },
    });
    this.ground = imageGround(this.surface);
  }

  /** Take over a new image; the one before is let go at once, not when the collector comes. */
  take(header, bitmap) {
    const before = this.bitmap;
    this.bitmap = bitmap;
    this.header = header;
    // The height of a smaller image was rounded; the camera's own size is exact.
    const [width, height] = store.get("state")?.camera.size_px ?? [header.width / header.scale, header.height / header.scale];
    this.setSize(Math.round(width), Math.round(height));
    this.drawImage();
    this.onImage?.(header, bitmap);
    before?.close();
  }

  /** Raw pixels of the whole image: pixel centres are whole numbers, so it begins at -0.5. */
  setSize(width, height) {
    this.size = [width, height];
    this.surface.viewport.setContent(-0.5, -0.5, width, height);
  }

  /** Width of images worth asking for. */
  wantedWidth() {
    const { base, viewport } = this.surface;
    const wanted = base.width * Math.min(viewport.zoom, 2);
    return OFFER_PX.find((width) => width >= wanted * 0.9) ?? OFFER_PX.at(-1);
  }

  #image() {
    const { base, dense, viewport } = this.surface;
    const g = base.getContext("2d", { alpha: false });
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.fillStyle = "#05070a";
    g.fillRect(0, 0, base.width, base.height);
    if (!this.bitmap) return;
    const [x, y] = viewport.toScreen(-0.5, -0.5);
    const s = viewport.scale;
    g.setTransform(dense, 0, 0, dense, 0, 0);
    g.imageSmoothingEnabled = s / this.header.scale < 3;
    g.drawImage(this.bitmap, x, y, this.size[0] * s, this.size[1] * s);
  }

  /** Where a raw pixel is on the page. @returns {number[]|null} client x, y */
  client(u, v) {
    const at = this.surface.project(u, v);
    const box = this.surface.base.getBoundingClientRect();
    return at && [box.left + at[0], box.top + at[1]];
  }
}

/** Age of the image that is shown; null while that is not known. */
export function imageAge(view, clock) {
  const now = clock.now();
  return view.header && now !== null ? Math.max(now - view.header.t, 0) : null;
}

/** Age of the newest state. */
export function stateAge(clock) {
  const now = clock.now();
  const state = store.get("state");
  return state && now !== null ? Math.max(now - state.t, 0) : null;
}
