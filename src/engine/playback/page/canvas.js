// Drawing without a graphics processor: the same formulas by tables.

/// Draws a show on a plain canvas.
function canvasRenderer(canvas, show) {
  const [width, height] = show.size;
  const context = canvas.getContext("2d", { alpha: false });
  const out = context.createImageData(width, height);
  out.data.fill(255);
  const sum = new Float32Array(width * height * 3);
  const bits = new Uint32Array(sum.buffer);
  // The display's code by the upper 16 bits of a float's magnitude and exponent: steps of 0.4 % of
  // light at most, each told by its middle. Negative light is black.
  const tone = new Float32Array(1 << 16);
  const probe = new Float32Array(1);
  const probeBits = new Uint32Array(probe.buffer);
  for (let i = 0; i < 0xff00; i++) {
    probeBits[0] = (i << 15) | (1 << 14);
    tone[i] = Math.round(shown(show.curve, probe[0]));
  }
  tone.fill(255, 0xff00);
  const pictures = [];

  /// Light of all codes of a picture times a weight; the second half is negative.
  const table = ([low, high], weight) => {
    const light = new Float32Array(512);
    for (let i = 0; i < 256; i++) {
      const c2 = (i / 255) ** 2;
      light[i] = weight * (low * c2 + high * c2 ** 4);
      light[256 + i] = -light[i];
    }
    return light;
  };
  const add = (index, weight) => {
    if (weight === 0) return;
    const { codes, signs, law } = pictures[index];
    const light = table(law, weight);
    if (signs) for (let i = 0; i < sum.length; i++) sum[i] += light[codes[i] + 256 * signs[i]];
    else for (let i = 0; i < sum.length; i++) sum[i] += light[codes[i]];
  };

  return {
    name: "canvas",
    wantsPixels: true,
    take(index, { law, signs: signed }, _, pixels) {
      if (!pixels) { pictures[index].law = law; return; }
      const codes = new Uint8Array(width * height * 3);
      const signs = signed ? new Uint8Array(codes.length) : null;
      for (let p = 0, i = 0; p < pixels.length; p += 4) {
        const negative = 255 - pixels[p + 3];
        for (let c = 0; c < 3; c++, i++) {
          codes[i] = pixels[p + c];
          if (signs) signs[i] = (negative >> c) & 1;
        }
      }
      pictures[index] = { codes, signs, law };
    },
    /// Draws a moment, or a sum of pictures where there is one.
    draw(frame, terms) {
      const [f0, f1, f2] = frame.factors;
      const weights = [(1 - f2) * (1 - f0), (1 - f2) * f0, f2 * (1 - f1), f2 * f1];
      sum.fill(0);
      for (const { picture, weight } of terms ?? weights.map((weight, k) => ({ picture: frame.keys[k], weight }))) add(picture, weight);
      const data = out.data;
      for (let i = 0, p = 0; i < sum.length; i += 3, p += 4) {
        for (let c = 0; c < 3; c++) {
          const raw = bits[i + c];
          data[p + c] = raw >>> 31 ? 0 : tone[raw >>> 15];
        }
      }
      context.putImageData(out, 0, 0);
    },
    read: () => ({ codes: out.data, bottomUp: false }),
  };
}
