/** Where everything was in the last seconds: bounded, one short list for each name. */

const KEEP_S = 10;
const STEP_S = 0.1;
const MOST_NAMES = 60;

export class Trails {
  #trails = new Map();

  /** @param {number} t session time [s] @param {string} name @param {number[]} uv */
  add(t, name, uv) {
    let trail = this.#trails.get(name);
    if (!trail || (trail.length && t < trail.at(-1).t - 1)) {
      // A clock that went back is another session.
      if (this.#trails.size >= MOST_NAMES) this.#trails.delete(this.#trails.keys().next().value);
      trail = [];
      this.#trails.set(name, trail);
    }
    if (!trail.length || t - trail.at(-1).t >= STEP_S) trail.push({ t, uv });
  }

  /** Forget what is too old. */
  age(t) {
    for (const [name, trail] of this.#trails) {
      while (trail.length && t - trail[0].t > KEEP_S) trail.shift();
      if (!trail.length) this.#trails.delete(name);
    }
  }

  /** @returns {{t: number, uv: number[]}[]} oldest first */
  of(name) {
    return this.#trails.get(name) ?? [];
  }

  /** How fresh a point is, 1 to 0. */
  static freshness(t, now) {
    return Math.max(1 - (now - t) / KEEP_S, 0);
  }
}
