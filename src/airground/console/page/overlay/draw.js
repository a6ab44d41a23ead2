/** Strokes that are seen on any image: a dark line beneath, the colour above. */

import { HALO } from "../colours.js";

/** Path of lines through raw pixels; broken where a point is null or not to be seen. */
export function trace(g, surface, points, closed = false) {
  g.beginPath();
  let pen = false;
  for (const point of points) {
    const at = point && Number.isFinite(point[0]) ? surface.project(point[0], point[1]) : null;
    if (!at) pen = false;
    else if (pen) g.lineTo(at[0], at[1]);
    else {
      g.moveTo(at[0], at[1]);
      pen = true;
    }
  }
  if (closed) g.closePath();
}

/** Stroke what was traced. */
export function stroke(g, colour, width, { dash = [], halo = true } = {}) {
  g.lineJoin = "round";
  g.lineCap = "round";
  g.setLineDash([]);
  if (halo) {
    g.strokeStyle = HALO;
    g.lineWidth = width + 2.5;
    g.stroke();
  }
  g.setLineDash(dash);
  g.strokeStyle = colour;
  g.lineWidth = width;
  g.stroke();
  g.setLineDash([]);
}

/** Arrow between places on the canvas. */
export function arrow(g, [x0, y0], [x1, y1], colour, width = 2.5, head = 10) {
  const long = Math.hypot(x1 - x0, y1 - y0);
  if (long < 2) return;
  const [ux, uy] = [(x1 - x0) / long, (y1 - y0) / long];
  const size = Math.min(head, long);
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(x1, y1);
  g.moveTo(x1 - size * (ux + 0.5 * uy), y1 - size * (uy - 0.5 * ux));
  g.lineTo(x1, y1);
  g.lineTo(x1 - size * (ux - 0.5 * uy), y1 - size * (uy + 0.5 * ux));
  stroke(g, colour, width);
}

/** Disc with a ring. */
export function disc(g, [x, y], radius, fill, ring = HALO, width = 2) {
  g.beginPath();
  g.arc(x, y, radius, 0, 2 * Math.PI);
  g.fillStyle = fill;
  g.fill();
  g.lineWidth = width;
  g.strokeStyle = ring;
  g.stroke();
}
