/** Texts on a canvas that neither cover each other nor are cut at its edge. */

const PLACES = [[1, -1], [1, 1], [-1, -1], [-1, 1], [0, -1], [0, 1], [1, 0], [-1, 0]];
const PAD = 5;

export class Labels {
  #taken = [];

  /** @param {CanvasRenderingContext2D} g @param {number} width @param {number} height [CSS px] */
  constructor(g, width, height) {
    this.g = g;
    this.width = width;
    this.height = height;
  }

  /** Keep labels off a place. */
  reserve(x, y, w, h) {
    this.#taken.push([x, y, w, h]);
  }

  /**
   * Write beside a point, where there is room; nothing where there is none.
   * @param {string} text
   * @param {number[]} at [CSS px]
   * @param {{away?: number, colour?: string, font?: string, must?: boolean, fill?: string}} [options] must: write it even over another
   */
  place(text, [x, y], { away = 12, colour = "#fff", font = "600 12px system-ui, sans-serif", must = false, fill = "rgba(8, 12, 16, 0.78)" } = {}) {
    const { g } = this;
    g.font = font;
    const most = this.width - 4 - 2 * PAD;
    const wide = g.measureText(text).width;
    // In a small view a long reason is cut: it stands in full beside the buttons.
    if (wide > most) text = `${text.slice(0, Math.max(Math.floor((text.length * most) / wide) - 2, 1))}…`;
    const w = Math.ceil(g.measureText(text).width) + 2 * PAD;
    const h = 19;
    if (x < -away || y < -away || x > this.width + away || y > this.height + away) return false;
    let first = null;
    for (const [sx, sy] of PLACES) {
      const left = Math.min(Math.max(sx === 0 ? x - w / 2 : sx > 0 ? x + away : x - away - w, 2), this.width - w - 2);
      const top = Math.min(Math.max(sy === 0 ? y - h / 2 : sy > 0 ? y + away * 0.6 : y - away * 0.6 - h, 2), this.height - h - 2);
      const box = [left, top, w, h];
      first ??= box;
      if (this.#free(box)) return this.#write(text, box, colour, fill);
    }
    return must ? this.#write(text, first, colour, fill) : false;
  }

  #free([x, y, w, h]) {
    return this.#taken.every(([X, Y, W, H]) => x + w <= X || X + W <= x || y + h <= Y || Y + H <= y);
  }

  #write(text, [x, y, w, h], colour, fill) {
    const { g } = this;
    g.fillStyle = fill;
    g.beginPath();
    g.roundRect(x, y, w, h, 5);
    g.fill();
    g.fillStyle = colour;
    g.textAlign = "left";
    g.textBaseline = "middle";
    g.fillText(text, x + PAD, y + h / 2 + 0.5);
    this.#taken.push([x, y, w, h]);
    return true;
  }
}
