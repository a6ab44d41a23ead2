/** One requestAnimationFrame loop for the whole page: parts that changed are drawn once in the next frame, others not at all. */

const waiting = new Set();
let asked = 0;

function run() {
  asked = 0;
  const now = [...waiting];
  waiting.clear();
  for (const draw of now) {
    try {
      draw();
    } catch (error) {
      // One part that fails must not take the others, nor STOP, with it.
      console.error(error);
    }
  }
}

/**
 * Make a part of the page that is drawn when it is told that something changed.
 * @param {() => void} draw
 * @returns {() => void} asks for it; as often as you like
 */
export function part(draw) {
  return () => {
    waiting.add(draw);
    if (!asked) asked = requestAnimationFrame(run);
  };
}
