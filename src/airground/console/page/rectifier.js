/** The shader of the bird's-eye view. */

const VERTEX = `#version 300 es
in vec2 corner;
void main() { gl_Position = vec4(corner, 0.0, 1.0); }`;

// Screen -> ground [m] -> undistorted px (homography) -> raw px (division lens in closed form) -> texture.
const FRAGMENT = `#version 300 es
precision highp float;
uniform mat3 image_from_ground;
uniform vec3 lens;         // k1, centre; in shares of the image's width
uniform vec3 size;         // of the image, and of a pixel, as shares of its width
uniform vec4 to_ground;    // x0, y0, metres per pixel of the canvas in x and y
uniform float side;        // sign of the third coordinate on the ground
uniform vec3 empty;
uniform sampler2D picture;
out vec4 colour;
void main() {
  vec2 ground = to_ground.xy + gl_FragCoord.xy * to_ground.zw;
  vec3 h = image_from_ground * vec3(ground, 1.0);
  colour = vec4(empty, 1.0);
  if (h.z * side <= 0.0) return;
  vec2 w = h.xy / h.z - lens.yz;
  float inside = 1.0 - 4.0 * lens.x * dot(w, w);
  if (inside < 0.0) return;
  vec2 raw = lens.yz + w * 2.0 / (1.0 + sqrt(inside));
  vec2 at = (raw + 0.5 * size.z) / size.xy;
  if (at.x < 0.0 || at.y < 0.0 || at.x > 1.0 || at.y > 1.0) return;
  colour = vec4(texture(picture, at).rgb, 1.0);
}`;

function program(gl) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return gl.getProgramParameter(made, gl.LINK_STATUS) ? made : null;
}

function colourOf(element) {
  const [r = 0, g = 0, b = 0] = (getComputedStyle(element).backgroundColor.match(/[\d.]+/g) ?? []).map(Number);
  return [r / 255, g / 255, b / 255];
}

/**
 * @param {HTMLCanvasElement} canvas
 * @returns {{upload: Function, draw: Function}|null} null where the browser cannot
 */
export function rectifier(canvas) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false });
  if (!gl) return null;
  let made = null;
  let where = {};
  let uploaded = false;

  function prepare() {
    made = program(gl);
    if (!made) return;
    const names = ["image_from_ground", "lens", "size", "to_ground", "side", "empty"];
    where = Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(made, name)]));
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    const corner = gl.getAttribLocation(made, "corner");
    gl.enableVertexAttribArray(corner);
    gl.vertexAttribPointer(corner, 2, gl.FLOAT, false, 0, 0);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const [name, value] of [["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"], ["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"]]) {
      gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], gl[value]);
    }
    uploaded = false;
  }
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", prepare);
  prepare();
  if (!made) return null;

  return {
    upload(bitmap) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
      uploaded = true;
    },

    /** @param {import("./geometry.js").GroundMap|null} map @param {number[]} size of the raw image [px] */
    draw(map, size, viewport, dense) {
      const empty = colourOf(canvas.parentElement);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(...empty, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      if (!map || !uploaded) return;
      gl.useProgram(made);
      // Pixels as shares of the width: k1 in 1/px2 and a homography in pixels would lose digits in floats.
      const s = 1 / size[0];
      const m = map.toImage.map((value, k) => (k < 6 ? value * s : value));
      const most = Math.max(...m.map(Math.abs));
      gl.uniformMatrix3fv(where.image_from_ground, true, m.map((value) => value / most));
      const { k1, center_px: [cu, cv] } = map.lens ?? { k1: 0, center_px: [0, 0] };
      gl.uniform3f(where.lens, k1 / (s * s), cu * s, cv * s);
      gl.uniform3f(where.size, 1, size[1] * s, s);
      const [x0, y0] = viewport.toContent(0, viewport.height);
      const metres = 1 / (viewport.scale * dense);
      gl.uniform4f(where.to_ground, x0, y0, metres, metres);
      gl.uniform1f(where.side, map.sign);
      gl.uniform3f(where.empty, ...empty);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    },
  };
}
