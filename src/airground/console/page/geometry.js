/**
 * From raw pixels to the ground and back. (0, 0) is the centre of the top-left pixel, v points down.
 * The lens is the division model: undistorted = c + (raw - c) / (1 + k1 |raw - c|^2).
 */

const NEAR = 30; // times the smallest area that a pixel sees
const LIMIT = 0.95; // of |k1| r^2, as in the Python model: beyond it the lens says nothing

/** @returns {number[]|null} undistorted pixel */
export function undistort(lens, u, v) {
  if (!lens || lens.k1 === 0) return [u, v];
  const [cu, cv] = lens.center_px;
  const du = u - cu, dv = v - cv;
  const x = lens.k1 * (du * du + dv * dv);
  return Math.abs(x) > LIMIT ? null : [cu + du / (1 + x), cv + dv / (1 + x)];
}

/** @returns {number[]|null} raw pixel: the root of the division model that is d = w for k1 = 0 */
export function distort(lens, u, v) {
  if (!lens || lens.k1 === 0) return [u, v];
  const [cu, cv] = lens.center_px;
  const wu = u - cu, wv = v - cv;
  const inside = 1 - 4 * lens.k1 * (wu * wu + wv * wv);
  if (inside < 0) return null;
  const grow = 2 / (1 + Math.sqrt(inside));
  const du = wu * grow, dv = wv * grow;
  return Math.abs(lens.k1) * (du * du + dv * dv) > LIMIT ? null : [cu + du, cv + dv];
}

/** Inverse of a 3 x 3 matrix, row by row. */
export function invert(m) {
  const [a, b, c, d, e, f, g, h, i] = m;
  const A = e * i - f * h, B = f * g - d * i, C = d * h - e * g;
  const det = a * A + b * B + c * C;
  return [A, c * h - b * i, b * f - c * e, B, a * i - c * g, c * d - a * f, C, b * g - a * h, a * e - b * d].map((x) => x / det);
}

const times = (m, x, y) => [m[0] * x + m[1] * y + m[2], m[3] * x + m[4] * y + m[5], m[6] * x + m[7] * y + m[8]];

/** Both ways between image and ground, for one calibration. */
export class GroundMap {
  /** @param {{ground_from_image: number[], lens: object|null, bounds_m: number[]}} rectify @param {number[]} sizePx */
  constructor(rectify, sizePx) {
    this.lens = rectify.lens;
    this.bounds = rectify.bounds_m;
    this.toGround = rectify.ground_from_image;
    this.toImage = invert(this.toGround);
    this.sign = this.#sideOfGround(sizePx);
  }

  /** The third coordinate has one sign on the ground and the other above the horizon: which, is what most of the bounds say. */
  #sideOfGround([width, height]) {
    const [x0, y0, x1, y1] = this.bounds;
    let votes = 0;
    for (let i = 0; i < 9; i++) {
      for (let j = 0; j < 9; j++) {
        const uv = undistort(this.lens, (i / 8) * (width - 1), (j / 8) * (height - 1));
        if (!uv) continue;
        const [x, y, w] = times(this.toGround, uv[0], uv[1]);
        const inside = x / w >= x0 && x / w <= x1 && y / w >= y0 && y / w <= y1;
        if (inside) votes += Math.sign(w);
      }
    }
    return votes < 0 ? -1 : 1;
  }

  /** The ground that is seen well, in metres: what is far away and small is left to whoever zooms out. */
  near([width, height]) {
    const found = [];
    for (let i = 0; i <= 24; i++) {
      for (let j = 0; j <= 24; j++) {
        const [u, v] = [(i / 24) * (width - 2), (j / 24) * (height - 2)];
        const [a, b, c] = [this.ground(u, v), this.ground(u + 1, v), this.ground(u, v + 1)];
        if (!a || !b || !c) continue;
        const size = Math.abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])); // of a pixel [m2]
        found.push({ xy: a, size });
      }
    }
    const best = Math.min(...found.map((one) => one.size));
    const well = found.filter((one) => one.size < NEAR * best).map((one) => one.xy);
    if (well.length < 3) return null;
    const [x0, y0, x1, y1] = this.bounds;
    const xs = well.map((p) => p[0]), ys = well.map((p) => p[1]);
    const [left, low] = [Math.max(Math.min(...xs), x0), Math.max(Math.min(...ys), y0)];
    return { x: left, y: low, w: Math.min(Math.max(...xs), x1) - left, h: Math.min(Math.max(...ys), y1) - low };
  }

  /** @returns {number[]|null} [m] of a raw pixel; null where there is no ground */
  ground(u, v) {
    const uv = undistort(this.lens, u, v);
    if (!uv) return null;
    const [x, y, w] = times(this.toGround, uv[0], uv[1]);
    return w * this.sign > 1e-12 ? [x / w, y / w] : null;
  }

  /** @returns {number[]|null} raw pixel of a ground point; null where the camera cannot see it */
  image(x, y) {
    const [u, v, w] = times(this.toImage, x, y);
    return w * this.sign > 1e-12 ? distort(this.lens, u / w, v / w) : null;
  }
}

/** Half axes and angle of the ellipse that holds 95 % of a normal distribution. */
export function ellipse([uu, uv, vv]) {
  const middle = (uu + vv) / 2, apart = Math.hypot((uu - vv) / 2, uv);
  const scale = Math.sqrt(5.991); // chi squared with two degrees of freedom
  return {
    a: scale * Math.sqrt(Math.max(middle + apart, 0)),
    b: scale * Math.sqrt(Math.max(middle - apart, 0)),
    angle: 0.5 * Math.atan2(2 * uv, uu - vv),
  };
}

/** Distance from a point to a piece of line, and where along it (0 to 1). */
export function toSegment([px, py], [ax, ay], [bx, by]) {
  const dx = bx - ax, dy = by - ay;
  const long = dx * dx + dy * dy;
  const at = long > 0 ? Math.min(Math.max(((px - ax) * dx + (py - ay) * dy) / long, 0), 1) : 0;
  return { distance: Math.hypot(px - ax - at * dx, py - ay - at * dy), at };
}

/** @returns {boolean} whether a point is in a polygon, by crossings */
export function inPolygon([x, y], polygon) {
  let inside = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [xi, yi] = polygon[i], [xj, yj] = polygon[j];
    if (yi > y !== yj > y && x < ((xj - xi) * (y - yi)) / (yj - yi) + xi) inside = !inside;
  }
  return inside;
}
