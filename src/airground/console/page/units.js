/** Numbers as people read them: no more digits than mean something, always with a unit. */

const LOST = "—";
const given = (x) => typeof x === "number" && Number.isFinite(x);

/** @param {number|null} x [m/s] */
export const speed = (x) => (given(x) ? `${minus(x.toFixed(2))} m/s` : `${LOST} m/s`);

/** A true minus sign, and no "-0.00". */
export const minus = (text) => (/^-0(\.0*)?$/.test(text) ? text.slice(1) : text.replace("-", "−"));

/** @param {number|null} x [m] */
export function distance(x) {
  if (!given(x)) return LOST;
  if (Math.abs(x) < 1) return `${(x * 100).toFixed(x < 0.1 ? 1 : 0)} cm`;
  return `${x.toFixed(x < 10 ? 2 : 1)} m`;
}

/** @param {number|null} x [px] */
export const pixels = (x) => (given(x) ? `${x.toFixed(Math.abs(x) < 10 ? 1 : 0)} px` : LOST);

/** @param {number|null} x [s] */
export function age(x) {
  if (!given(x)) return LOST;
  if (x < 1) return `${Math.max(Math.round(x * 1000), 0)} ms`;
  return x < 60 ? `${x.toFixed(1)} s` : `${Math.round(x / 60)} min`;
}

/** @param {number|null} x share */
export const percent = (x) => (given(x) ? `${(x * 100).toFixed(x < 0.1 ? 1 : 0)} %` : LOST);

/** Time of the session. */
export function clock(t) {
  const whole = Math.max(Math.floor(t), 0);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}
