/** Which part of a picture is seen where on a canvas: letterboxed, zoomed, moved. Picture units in, CSS pixels out. */

const MOST_ZOOM = 12;

export class Viewport {
  width = 1;
  height = 1;
  zoom = 1;
  #box = { x: 0, y: 0, w: 1, h: 1 };
  #centre = [0.5, 0.5];
  #flip = 1;
  #home = null; // what is shown at first, where that is not all
  #touched = false;

  /** What is to be seen. `up`: whether y points up, as on the ground. */
  setContent(x, y, w, h, { up = false, home = null } = {}) {
    const same = this.#box.x === x && this.#box.y === y && this.#box.w === w && this.#box.h === h;
    this.#box = { x, y, w, h };
    this.#home = home;
    this.#flip = up ? -1 : 1;
    if (!same) this.fit();
  }

  resize(width, height) {
    this.width = Math.max(width, 1);
    this.height = Math.max(height, 1);
    if (this.#touched) this.#hold();
    else this.fit();
  }

  /** CSS pixels per unit. */
  get scale() {
    return this.zoom * Math.min(this.width / this.#box.w, this.height / this.#box.h);
  }

  fit() {
    const { x, y, w, h } = this.#home ?? this.#box;
    this.zoom = 1;
    this.zoom = Math.min(Math.max(Math.min(this.width / w, this.height / h) / this.scale, 1), MOST_ZOOM);
    this.#centre = [x + w / 2, y + h / 2];
    this.#touched = false;
    this.#hold();
  }

  toScreen(x, y) {
    const s = this.scale;
    return [this.width / 2 + (x - this.#centre[0]) * s, this.height / 2 + (y - this.#centre[1]) * s * this.#flip];
  }

  toContent(sx, sy) {
    const s = this.scale;
    return [this.#centre[0] + (sx - this.width / 2) / s, this.#centre[1] + ((sy - this.height / 2) / s) * this.#flip];
  }

  contains([x, y]) {
    const { x: x0, y: y0, w, h } = this.#box;
    return x >= x0 && y >= y0 && x <= x0 + w && y <= y0 + h;
  }

  /** Zoom so that what is under a place of the canvas stays there. */
  zoomAt(sx, sy, factor) {
    const [x, y] = this.toContent(sx, sy);
    this.#touched = true;
    this.zoom = Math.min(Math.max(this.zoom * factor, 1), MOST_ZOOM);
    const [nx, ny] = this.toContent(sx, sy);
    this.#centre = [this.#centre[0] + x - nx, this.#centre[1] + y - ny];
    this.#hold();
  }

  pan(dx, dy) {
    const s = this.scale;
    this.#touched = true;
    this.#centre = [this.#centre[0] - dx / s, this.#centre[1] - (dy / s) * this.#flip];
    this.#hold();
  }

  /** The picture may not leave the canvas: it is centred where it is smaller, and fills it where it is larger. */
  #hold() {
    const s = this.scale;
    const hold = (centre, low, size, seen) => {
      const half = seen / 2 / s;
      return half * 2 >= size ? low + size / 2 : Math.min(Math.max(centre, low + half), low + size - half);
    };
    const { x, y, w, h } = this.#box;
    this.#centre = [hold(this.#centre[0], x, w, this.width), hold(this.#centre[1], y, h, this.height)];
  }
}
