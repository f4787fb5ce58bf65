// Drawing by the graphics processor: every picture is a texture of codes; decoding, blending,
// exposure, curve and sRGB are done in floats for each pixel.

const VERTEX = `#version 300 es
const vec2 corners[3] = vec2[3](vec2(-1.0, -1.0), vec2(3.0, -1.0), vec2(-1.0, 3.0));
void main() { gl_Position = vec4(corners[gl_VertexID], 0.0, 1.0); }`;

const DECODE = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
uniform int height;
out vec4 colour;
// Alpha is 1 but for the signs: 255 less one for negative red, two for green, four for blue.
vec3 light(sampler2D picture, vec2 law) {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 code = texelFetch(picture, ivec2(at.x, height - 1 - at.y), 0);
  vec3 c2 = code.rgb * code.rgb;
  vec3 c4 = c2 * c2;
  int signs = 255 - int(code.a * 255.0 + 0.5);
  vec3 sign = 1.0 - 2.0 * vec3(float(signs & 1), float((signs >> 1) & 1), float((signs >> 2) & 1));
  return sign * (law.x * c2 + law.y * c4 * c4);
}
`;

const TONE = `
uniform bool filmic;
vec4 display(vec3 light) {
  vec3 x = max(light, 0.0);
  vec3 b = min(x, 1.0);
  if (filmic) {
    vec3 y = min(2.0 * x, 5.0);
    b = y * (1.0 + y / 25.0) / (1.0 + y);
  }
  vec3 high = 1.055 * pow(max(b, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
  vec3 code = mix(high, 12.92 * b, vec3(lessThanEqual(b, vec3(0.0031308))));
  return vec4(code, 1.0);
}
`;

const BLEND = `
uniform sampler2D key0, key1, key2, key3;
uniform vec2 laws[4];
uniform vec3 factors;
uniform int degree;
vec3 frame() {
  vec3 sum = light(key0, laws[0]);
  if (degree > 0) sum = mix(sum, light(key1, laws[1]), factors.x);
  if (degree == 2) sum = mix(sum, light(key2, laws[2]), factors.z);
  if (degree == 3) sum = mix(sum, mix(light(key2, laws[2]), light(key3, laws[3]), factors.y), factors.z);
  return sum;
}
`;

const ADD = `
uniform sampler2D key0;
uniform vec2 laws[4];
uniform float weight;
void main() { colour = vec4(weight * light(key0, laws[0]), 0.0); }`;

const SHOW = `
uniform sampler2D key0;
void main() { colour = display(texelFetch(key0, ivec2(gl_FragCoord.xy), 0).rgb); }`;

function program(gl, body) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, body]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  gl.useProgram(made);
  const found = new Map();
  const uniform = (name) => {
    if (!found.has(name)) found.set(name, gl.getUniformLocation(made, name));
    return found.get(name);
  };
  for (let i = 0; i < 4; i++) gl.uniform1i(uniform("key" + i), i);
  return { use: () => gl.useProgram(made), uniform };
}

function texture(gl) {
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  return gl.getParameter(gl.TEXTURE_BINDING_2D);
}

/// Draws a show on `canvas`; null where WebGL 2 or its float targets are missing.
function webglRenderer(canvas, show) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false });
  if (!gl || !gl.getExtension("EXT_color_buffer_float")) return null;
  const [width, height] = show.size;
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
  gl.viewport(0, 0, width, height);
  const sum = texture(gl);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, width, height);
  const target = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, sum, 0);
  if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) return null;
  const straight = program(gl, DECODE + TONE + BLEND + "void main() { colour = display(frame()); }");
  const added = program(gl, DECODE + ADD);
  const toned = program(gl, DECODE + TONE + SHOW);
  for (const p of [straight, added, toned]) { p.use(); gl.uniform1i(p.uniform("height"), height); }
  for (const p of [straight, toned]) {
    p.use();
    gl.uniform1i(p.uniform("filmic"), show.curve === "filmic");
  }
  gl.clearColor(0, 0, 0, 0);
  const textures = [], lawOf = [];

  const bind = (p, pictures) => {
    const laws = new Float32Array(8);
    pictures.forEach((index, unit) => {
      laws.set(lawOf[index], 2 * unit);
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, textures[index]);
    });
    gl.uniform2fv(p.uniform("laws"), laws);
  };
  const paint = () => gl.drawArrays(gl.TRIANGLES, 0, 3);
  const blend = (p, frame) => {
    p.use();
    bind(p, frame.keys.slice(0, frame.degree + 1));
    gl.uniform3fv(p.uniform("factors"), frame.factors);
    gl.uniform1i(p.uniform("degree"), frame.degree);
    paint();
  };

  return {
    name: "WebGL",
    /// Takes picture `index` as an image, or as pixels with signs in alpha; neither where its codes
    /// stay and their law alone is another.
    take(index, { law }, image, pixels) {
      lawOf[index] = law;
      if (!image && !pixels) return;
      gl.deleteTexture(textures[index] ?? null);
      textures[index] = texture(gl);
      const format = [gl.RGBA, gl.UNSIGNED_BYTE];
      if (pixels) gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, height, 0, ...format, pixels);
      else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, ...format, image);
    },
    wantsPixels: false,
    /// Draws a moment, or a sum of pictures where there is one.
    draw(frame, terms) {
      if (!terms) {
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        blend(straight, frame);
        return;
      }
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, null);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      gl.clear(gl.COLOR_BUFFER_BIT);
      added.use();
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE);
      for (const { picture, weight } of terms) {
        bind(added, [picture]);
        gl.uniform1f(added.uniform("weight"), weight);
        paint();
      }
      gl.disable(gl.BLEND);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      toned.use();
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, sum);
      paint();
    },
    /// The codes on the canvas, rows from the top; to be called right after drawing.
    read() {
      const raw = new Uint8Array(width * height * 4);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, raw);
      return { codes: raw, bottomUp: true };
    },
  };
}
