/** Colours on the image. They do not follow the theme: the image is the same in both. Red is kept for what must not be. */

const ROBOTS = ["#38c6ff", "#ffb02e", "#6ee58f", "#d59bff", "#fff05a", "#ff8fc0", "#8fb4ff", "#c9e265", "#ffa07a"];
const SPEEDS = [[94, 60, 170], [59, 110, 190], [33, 150, 160], [75, 195, 110], [190, 222, 60], [253, 235, 50]];

export const OTHER = "#e3e9ee";
export const RED = "#ff4d4f";
export const FENCE = "#5be39b";
export const KEEP_OUT = "#ff7a59";
export const HALO = "rgba(6, 10, 14, 0.75)";

// A robot that is called blue is not drawn in orange. Red has no red: that is kept.
const NAMED = { red: "#ff8fc0", blue: "#38c6ff", green: "#6ee58f", yellow: "#fff05a", orange: "#ffb02e", violet: "#d59bff", white: "#ffffff", black: "#aeb9c4" };

/** @param {string[]} names of all robots, in the site's order @param {string} name */
export function robotColour(names, name) {
  const named = (one) => NAMED[one.toLowerCase()];
  if (named(name)) return named(name);
  const taken = new Set(names.map(named));
  const free = ROBOTS.filter((colour) => !taken.has(colour));
  const index = names.filter((one) => !named(one)).indexOf(name);
  return free[Math.max(index, 0) % free.length];
}

/** Colour of a speed as a share of the fastest, slow is violet and fast is yellow: told apart by brightness alone too. */
export function speedColour(share) {
  const x = Math.min(Math.max(share, 0), 1) * (SPEEDS.length - 1);
  const k = Math.min(Math.floor(x), SPEEDS.length - 2);
  const mix = SPEEDS[k].map((low, i) => Math.round(low + (x - k) * (SPEEDS[k + 1][i] - low)));
  return `rgb(${mix.join(",")})`;
}
