// Levels from a picture that is dropped on the stage: the levels of all banks whose light comes
// nearest to it. The page has every bank's picture, and light adds up, so that this is a problem of
// least squares between out and full. `footlight solve` does the same with more: files of light,
// banks by name, a free exposure.

/// About how many blocks across are compared.
const BLOCKS = 100;
/// Largest difference of shape between picture and stage.
const SHAPE = 0.1;
/// A picture whose luminance varies by the first, relative to it, and agrees with the nearest light
/// by a correlation below the second, is of another place.
const VARIES = 0.2, LIKE = 0.5;
/// Milliseconds for which the answer stands on the stage.
const STANDS = 15000;

/// The exposed light that shows as a code, 0 to 255: the inverse of `shown`. The codes at the ends
/// stand for a whole range.
function lightOfCode(curve, code) {
  const b = decodedLight(Math.min(Math.max(code, 0.25), 254.5) / 255);
  return curve === "filmic" ? 6.25 * (b - 1 + Math.sqrt((1 - b) ** 2 + 0.16 * b)) : b;
}

/// Sums over blocks of pixels, each channel by itself; `value(p, c)` is that of channel c of the
/// pixel whose codes begin at p.
function blockSums([width, height], value) {
  const side = Math.max(Math.round(width / BLOCKS), 1), across = Math.ceil(width / side);
  const sums = new Float64Array(3 * across * Math.ceil(height / side));
  for (let y = 0, p = 0; y < height; y++) {
    const row = across * Math.floor(y / side);
    for (let x = 0; x < width; x++, p += 4) {
      const at = 3 * (row + Math.floor(x / side));
      for (let c = 0; c < 3; c++) sums[at + c] += value(p, c);
    }
  }
  return sums;
}

/// The picture's light in each block, where it is white and where it is not black, and the pixels'
/// weights.
function readSketch(bitmap) {
  const [width, height] = show.size;
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d");
  context.drawImage(bitmap, 0, 0, width, height);
  const { data } = context.getImageData(0, 0, width, height);
  const table = Float64Array.from({ length: 256 }, (_, code) => lightOfCode(show.curve, code));
  const alpha = (p) => data[p + 3] / 255;
  return {
    alpha,
    cover: blockSums(show.size, alpha),
    light: blockSums(show.size, (p, c) => alpha(p) * table[data[p + c]]),
    white: blockSums(show.size, (p, c) => Number(alpha(p) > 0 && data[p + c] === 255)),
    lit: blockSums(show.size, (p, c) => Number(alpha(p) > 0 && data[p + c] > 0)),
  };
}

/// The light of coordinate `i` at full in each block.
async function bankLight(i, alpha) {
  const { codes: address, signs, law: [low, high] } = show.pictures[show.keys + show.coordinates[i].picture];
  const codes = await pixelsOf(await decoded(address), signs, show.size);
  const table = Float64Array.from({ length: 256 }, (_, code) => low * (code / 255) ** 2 + high * (code / 255) ** 8);
  const sign = (p, c) => (((255 - codes[p + 3]) >> c) & 1 ? -1 : 1);
  return blockSums(show.size, (p, c) => alpha(p) * sign(p, c) * table[codes[p + c]]);
}

/// Settings of `columns`, each from 0 to `full`, whose sum comes nearest to `meant`, from `start` on;
/// `weights` are those of the rows.
function nearest(columns, meant, weights, start, full = 1) {
  const product = (a, b) => a.reduce((sum, value, row) => sum + weights[row] * value * b[row], 0);
  const squares = columns.map((a, i) => columns.map((b, k) => (k <= i ? product(a, b) : 0)));
  const square = (i, k) => (k <= i ? squares[i][k] : squares[k][i]);
  const right = columns.map((a) => product(a, meant));
  // A bank that is hardly seen stays as it stands.
  const unseen = 1e-7 * Math.max(...columns.map((_, i) => square(i, i)));
  const x = [...start];
  for (let round = 0, most = 1; round < 5000 && most > 1e-6; round++) {
    most = 0;
    columns.forEach((_, i) => {
      if (square(i, i) <= unseen) return;
      const slope = x.reduce((sum, value, k) => sum - square(i, k) * value, right[i]);
      const next = Math.min(Math.max(x[i] + slope / square(i, i), 0), full);
      most = Math.max(most, Math.abs(next - x[i]));
      x[i] = next;
    });
  }
  return x;
}

/// Correlation of two lists of luminances, and how far the second varies, relative to it.
function likeness(a, b, weights) {
  const sum = (of) => weights.reduce((total, weight, i) => total + weight * of(i), 0);
  const all = sum(() => 1), [meanA, meanB] = [a, b].map((list) => sum((i) => list[i]) / all);
  const [aa, bb, ab] = [[a, a, meanA, meanA], [b, b, meanB, meanB], [a, b, meanA, meanB]]
    .map(([p, q, meanP, meanQ]) => sum((i) => (p[i] - meanP) * (q[i] - meanQ)));
  return { like: ab / Math.max(Math.sqrt(aa * bb), 1e-300), varies: Math.sqrt(bb / sum((i) => b[i] ** 2)) };
}

let answered;
/// Holds the banks at the levels that come nearest to a picture.
async function solveSketch(file) {
  const say = (text) => {
    element("sketched").textContent = text;
    clearTimeout(answered);
    answered = setTimeout(() => { element("sketched").textContent = ""; }, STANDS);
  };
  const grand = grandLevel();
  if (grand === 0) return say(desk.isDark ? "Lift the blackout first." : "Raise the grand master first.");
  const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
  const bitmap = await createImageBitmap(file, options).catch(() => null);
  if (!bitmap) return say(`${file.name} is not a PNG, JPEG or WebP picture, or it is damaged; \`footlight solve\` also takes OpenEXR.`);
  const [width, height] = show.size;
  if (Math.abs(Math.log(bitmap.width * height / (bitmap.height * width))) > SHAPE) {
    return say(`${file.name} has ${bitmap.width}x${bitmap.height} pixels, the stage ${width}x${height}: cut it to this shape.`);
  }
  say(`Looking for the levels of ${file.name}`);
  const version = show, { alpha, cover, light, white, lit } = readSketch(bitmap);
  if (!lit.some((count) => count > 0)) return say(`${file.name} is black, or transparent.`);
  const all = [];
  for (let i = 0; i < version.coordinates.length; i++) all.push(await bankLight(i, alpha));
  // Another version of the show has come meanwhile.
  if (version !== show) return solveSketch(file);
  const now = lightOf(show, desk).map((setting, i) => (desk.held.has(i) ? settingOf(show.coordinates[i].law, desk.held.get(i)) : setting));
  const moving = all.map((_, i) => i).filter((i) => show.coordinates[i].varies);
  const columns = moving.map((i) => all[i].map((value) => grand * value));
  const rest = light.map((_, row) => all.reduce((sum, column, i) => sum + (show.coordinates[i].varies ? 0 : now[i] * column[row]), 0));
  const luminance = (of, row) => { const at = row - row % 3; return 0.2126 * of[at] + 0.7152 * of[at + 1] + 0.0722 * of[at + 2]; };
  const total = (list) => list.reduce((sum, value) => sum + value, 0);
  const mean = total(light.map((_, row) => luminance(light, row))) / total(cover);
  // Bright places must not outweigh all others.
  const weights = light.map((_, row) => (cover[row] > 0 ? cover[row] / (luminance(light, row) + mean * cover[row]) ** 2 : 0));
  const meant = light.map((value, row) => value - rest[row]);
  const shows = (x) => light.map((_, row) => rest[row] + x.reduce((sum, value, k) => sum + value * columns[k][row], 0));
  // White may stand for more light, and black for less.
  const agrees = (sum, row) => (white[row] && sum[row] > light[row]) || (!lit[row] && sum[row] < light[row]);
  const whole = light.reduce((total, value, row) => total + weights[row] * value ** 2, 0);
  const off = (sum) => Math.sqrt(light.reduce((total, value, row) => total + (agrees(sum, row) ? 0 : weights[row] * (sum[row] - value) ** 2), 0) / whole);
  // White is all that the picture shows of a lamp.
  const seen = weights.map((weight, row) => (white[row] ? 0 : weight));
  const free = nearest(all, light, seen, all.map(() => 0), Infinity);
  const best = light.map((value, row) => {
    const sum = all.reduce((most, column, i) => most + free[i] * column[row], 0);
    return white[row] ? Math.min(sum, value) : sum;
  });
  const pixels = weights.filter((_, row) => row % 3 === 0), [a, b] = [best, light].map((of) => pixels.map((_, k) => luminance(of, 3 * k)));
  const { like, varies } = likeness(a, b, pixels);
  if (varies > VARIES && like < LIKE) return say(`${file.name} is not of this view: bright and dark are elsewhere.`);
  const start = moving.map((i) => now[i]);
  const before = off(shows(start));
  let x = start, counted = "";
  for (let round = 0; round < 20; round++) {
    const sum = shows(x), own = weights.map((weight, row) => (round > 0 && agrees(sum, row) ? 0 : weight));
    const next = own.map((weight) => Number(weight > 0)).join("");
    if (next === counted) break;
    counted = next;
    x = nearest(columns, meant, own, x);
  }
  const found = [...now];
  moving.forEach((i, k) => { found[i] = x[k]; });
  let moved = 0;
  for (const fader of faders) {
    const stands = mixesOf(fader, lightOf(show, desk)).now, written = fader.mixer && mixAt(fader.mixer.track, desk.time);
    const mix = mixOfLight(fader, found.slice(fader.first, fader.first + fader.count), written);
    if (sameMix(stands, mix)) continue;
    hold(fader, mix);
    moved++;
  }
  const share = (value) => `${(100 * value).toFixed(value < 0.1 ? 1 : 0)} %`;
  const what = moved ? `${share(off(shows(x)))} differs, ${share(before)} before` : `no fader moves, ${share(before)} differs`;
  say(`${file.name}: ${what}${grand < 1 && x.some((value) => value > 0.999) ? "; the grand master is the limit" : ""}`);
}

/// A picture that is dropped on the stage, or chosen.
function takeSketches() {
  const stage = element("frame"), chosen = element("sketch-file");
  const solve = (file) => file && solveSketch(file).catch(cannotPlay);
  element("sketch").addEventListener("click", () => chosen.click());
  chosen.addEventListener("change", () => { solve(chosen.files[0]); chosen.value = ""; });
  // Elsewhere on the page a dropped file would take the page's place.
  for (const name of ["dragover", "drop"]) document.addEventListener(name, (event) => event.preventDefault());
  for (const name of ["dragenter", "dragover", "dragleave", "drop"]) {
    stage.addEventListener(name, () => stage.classList.toggle("takes", !desk.follows && /enter|over/.test(name)));
  }
  stage.addEventListener("drop", (event) => { if (!desk.follows) solve(event.dataTransfer.files[0]); });
}
