/** All that the page knows, by key, and who wants to hear when it changes. The newest per key wins. */

const values = new Map();
const listeners = new Map();

export const store = {
  /** @param {string} key */
  get: (key) => values.get(key) ?? null,

  /** @param {string} key @param {any} value */
  set(key, value) {
    values.set(key, value);
    for (const listener of listeners.get(key) ?? []) listener(value);
  },

  /** Change of a key that holds something simple; nothing is told where it is the same. */
  change(key, value) {
    if (values.get(key) !== value) store.set(key, value);
  },

  /**
   * @param {string[]} keys
   * @param {(value: any) => void} listener
   */
  on(keys, listener) {
    for (const key of keys) {
      if (!listeners.has(key)) listeners.set(key, []);
      listeners.get(key).push(listener);
    }
  },
};

/** The robot that orders go to: its view in the newest state, or null. */
export function chosenRobot() {
  const name = store.get("chosen");
  return store.get("state")?.robots.find((robot) => robot.name === name) ?? null;
}

/** What the site says about a robot: limits and kind. */
export function robotInfo(name) {
  return store.get("hello")?.site.robots.find((robot) => robot.name === name) ?? null;
}

/** Whether orders may be sent. */
export const holdsControls = () => store.get("controls")?.you === true;

/** Path that is shown for a robot: the newest one, unless it was discarded here. */
export function pathOf(name) {
  const path = store.get("paths")?.get(name) ?? null;
  const discarded = store.get("discarded")?.get(name) ?? -1;
  return path && path.sketch > discarded ? path : null;
}

/** @returns {boolean} */
export const drivable = (path) => path.points.length > 1 && path.undrivable.length === 0;
