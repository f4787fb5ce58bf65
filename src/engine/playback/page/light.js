// The formulas of light, the same for both ways of drawing. Light is linear throughout; a picture's
// codes c stand for low (c/255)^2 + high (c/255)^8, and are decoded before anything is blended.

/// Factors of the lerps in a segment of `degree` at `t`; the formula in all degrees is
/// lerp(lerp(A, B, f0), lerp(C, D, f1), f2).
function factors(degree, t) {
  if (degree === 0) return [0, 0, 0];
  if (degree === 1) return [t, 0, 0];
  if (degree === 2) return [2 * t / (1 + t), 0, t * t];
  return [3 * t / (1 + 2 * t), t / (3 - 2 * t), t * t * (3 - 2 * t)];
}

/// The keys of a segment as A, B, C, D of that formula; some are not read in lower degrees.
function fourKeys(keys) {
  const last = keys[keys.length - 1];
  return [keys[0], keys[1] ?? keys[0], keys[2] ?? last, keys[3] ?? last];
}

/// How many of a list in time have begun.
function begun(list, time, start) {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (start(list[middle]) <= time) low = middle + 1; else high = middle;
  }
  return low;
}

/// What a moment shows: four keys and their factors, and the settings of all coordinates.
function momentAt(show, time) {
  const segment = show.segments[Math.max(begun(show.segments, time, (s) => s.start) - 1, 0)];
  const length = segment.end - segment.start;
  const t = length > 0 ? Math.min(Math.max((time - segment.start) / length, 0), 1) : 0;
  const [f0, f1, f2] = factors(segment.degree, t);
  const keys = fourKeys(segment.keys);
  const weights = [(1 - f2) * (1 - f0), (1 - f2) * f0, f2 * (1 - f1), f2 * f1];
  const settings = show.coordinates.map((_, i) =>
    weights.reduce((sum, w, k) => sum + (w === 0 ? 0 : w * show.settings[keys[k]][i]), 0));
  return { degree: segment.degree, keys, factors: [f0, f1, f2], settings };
}

/// The setting of a level, 0 to 1, by a bank's dimmer: a power, or a table over the levels.
function settingOf(law, level) {
  if (typeof law === "number") return level ** law;
  const at = Math.min(Math.max(level, 0), 1) * (law.length - 1);
  const below = Math.min(Math.floor(at), law.length - 2);
  return law[below] + (at - below) * (law[below + 1] - law[below]);
}

/// The lowest level of a setting.
function levelOf(law, setting) {
  const s = Math.min(Math.max(setting, 0), 1);
  if (typeof law === "number") return s ** (1 / law);
  let i = law.findIndex((value) => value >= s - 1e-9);
  if (i < 0) return 1;
  if (i === 0) return 0;
  const rise = law[i] - law[i - 1];
  return (i - 1 + (rise > 0 ? (s - law[i - 1]) / rise : 1)) / (law.length - 1);
}

/// Level and colour of a bank of mixers at a time: straight between the points of its track.
function mixAt(track, time) {
  const after = begun(track, time, (point) => point[0]);
  const a = track[Math.max(after - 1, 0)], b = track[Math.min(after, track.length - 1)];
  const t = b[0] > a[0] ? (time - a[0]) / (b[0] - a[0]) : 0;
  const [level, ...colour] = a.slice(1).map((v, k) => v + t * (b[k + 1] - v));
  return { level, colour };
}

/// The code of sRGB, 0 to 1, of linear light (IEC 61966-2-1); and back.
function coded(light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
}
function decodedLight(code) {
  return code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4;
}

/// The displayed code, 0 to 255 and not rounded, of exposed light.
function shown(curve, light) {
  const x = Math.max(light, 0);
  let b = Math.min(x, 1);
  if (curve === "filmic") {
    const y = 2 * x;
    b = y >= 5 ? 1 : y * (1 + y / 25) / (1 + y);
  }
  return 255 * coded(b);
}
