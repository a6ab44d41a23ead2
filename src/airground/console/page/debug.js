/** `window.airground`: what the page knows, for tests and for a look at the console. Read-only: nothing can be ordered by it. */

export function expose({ store, view, bird, connection, tools, events, stop }) {
  const copy = (value) => (value === null || value === undefined ? null : structuredClone(value));
  const api = {
    get state() {
      return copy(store.get("state"));
    },
    get calibration() {
      return copy(store.get("calibration"));
    },
    get paths() {
      return Object.fromEntries(copy(store.get("paths")) ?? []);
    },
    get fences() {
      return copy(store.get("fences"));
    },
    get hello() {
      return copy(store.get("hello"));
    },
    get controls() {
      return copy(store.get("controls"));
    },
    get chosen() {
      return store.get("chosen");
    },
    get tool() {
      return tools.current.name;
    },
    get connection() {
      return { state: connection.state, roundTrip: connection.clock.roundTrip, now: connection.clock.now() };
    },
    get events() {
      return copy(events.all());
    },
    get image() {
      return copy(view.header);
    },
    get stopPending() {
      return stop.pending;
    },
    /** Raw pixel to client coordinates, on the live image. */
    viewFromImage: (u, v) => view.client(u, v),
    /** Raw pixel to client coordinates, on the bird's-eye view; null where it is no ground. */
    birdFromImage(u, v) {
      const at = bird.surface.project(u, v);
      const box = bird.surface.base.getBoundingClientRect();
      return at && [box.left + at[0], box.top + at[1]];
    },
    /** Client coordinates to raw pixel. */
    imageFromView(x, y) {
      const box = view.surface.base.getBoundingClientRect();
      return view.surface.unproject(x - box.left, y - box.top);
    },
    /** Raw pixel to ground [m]; null without a calibration. */
    groundFromImage: (u, v) => bird.map?.ground(u, v) ?? null,
    imageFromGround: (x, y) => bird.map?.image(x, y) ?? null,
  };
  Object.defineProperty(window, "airground", { value: Object.freeze(api), writable: false });
}
