// From the pictures in this file to a desk that plays. After the page's address `?at=12.5` opens it
// at that second, `hold=lamp:40` with that fader held, `renderer=canvas` does without the graphics
// processor, `test=0,1.5` writes what the canvas shows at those seconds into the page.

const asked = new URLSearchParams(location.search);

async function decoded(code) {
  const image = new Image();
  image.src = code;
  await image.decode();
  return image;
}

/// An image's pixels; signs go to alpha: 255 less one for negative red, two for green, four for blue.
async function pixelsOf(image, signs, [width, height]) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d", { willReadFrequently: true });
  const read = (from) => { context.drawImage(from, 0, 0); return context.getImageData(0, 0, width, height).data; };
  const pixels = read(image);
  if (signs) {
    const negative = read(await decoded(signs));
    for (let p = 0; p < pixels.length; p += 4) {
      const bit = (c) => (negative[p + c] > 127 ? 1 << c : 0);
      pixels[p + 3] = 255 - bit(0) - bit(1) - bit(2);
    }
  }
  return new Uint8Array(pixels.buffer);
}

/// Gives every picture of a show to `take`, those left out whose codes are as they were in `had`.
async function load(next, wantsPixels, had, take) {
  const one = async (picture, index) => {
    const same = had[index] && picture.codes === had[index].codes && picture.signs === had[index].signs;
    const image = same ? null : await decoded(picture.codes);
    const pixels = !same && (wantsPixels || picture.signs) ? await pixelsOf(image, picture.signs, next.size) : null;
    take(index, picture, image, pixels);
    // A key in the page itself is read once; banks are read again for levels from a picture.
    if (index < next.keys && picture.codes.startsWith("data:")) picture.codes = "";
  };
  // A few at a time: decoding runs beside the page, and memory holds few images.
  const queue = next.pictures.map((picture, index) => [picture, index]);
  let done = 0;
  const worker = async () => {
    for (let job = queue.shift(); job; job = queue.shift()) {
      await one(...job);
      if (!show) element("notice").textContent = `Loading the pictures: ${++done} of ${next.pictures.length}`;
    }
  };
  await Promise.all([worker(), worker(), worker(), worker()]);
}

/// What draws a show on a canvas that has drawn nothing yet, or on one in its place: a canvas that
/// has given out a WebGL context gives no other.
function rendererFor(next, first) {
  let canvas = first;
  [canvas.width, canvas.height] = next.size;
  let renderer = asked.get("renderer") === "canvas" ? null : webglRenderer(canvas, next);
  if (!renderer) {
    canvas = first.cloneNode();
    renderer = canvasRenderer(canvas, next);
  }
  canvas.addEventListener("webglcontextlost", () => {
    element("notice").textContent = "The graphics processor was reset; load the page again.";
  });
  return Object.assign(renderer, { canvas });
}

/// Draws a first version of a show.
async function openShow(first) {
  const canvas = element("picture"), renderer = rendererFor(first, canvas);
  if (renderer.canvas !== canvas) canvas.replaceWith(renderer.canvas);
  await load(first, renderer.wantsPixels, [], renderer.take);
  element("notice").textContent = "";
  show = first;
  length = show.end - show.start;
  Object.assign(desk, standing(show), { renderer });
  fill();
  listen();
  drawThumbnails(300);
  for (const id of ["go", "back", "stop", "play", "full"]) element(id).disabled = false;
  if (asked.has("at")) seek(Number(asked.get("at")));
  for (const words of asked.getAll("hold")) {
    const [name, level] = words.split(":");
    const i = show.coordinates.findIndex((c) => c.name === name && c.varies);
    if (i >= 0) desk.held.set(i, Math.min(Math.max(Number(level) / 100, 0), 1) || 0);
  }
  requestAnimationFrame(frame);
}

/// The codes on the canvas as rows from the top, in base64.
function told(renderer) {
  const [width, height] = show.size;
  const { codes, bottomUp } = renderer.read();
  let text = "";
  for (let y = 0; y < height; y++) {
    const row = (bottomUp ? height - 1 - y : y) * width * 4;
    for (let x = 0; x < 4 * width; x++) if (x % 4 < 3) text += String.fromCharCode(codes[row + x]);
  }
  return btoa(text);
}

/// Frames at the seconds asked for, one line a frame; and how far the show gets by itself.
async function test(renderer) {
  const lines = asked.get("test").split(",").map((seconds) => {
    const moment = momentAt(show, Number(seconds));
    renderer.draw(moment, sumAt(moment.settings, moment));
    return told(renderer);
  });
  const start = desk.time;
  play(true);
  const begin = performance.now();
  while (desk.time < start + 0.3 && performance.now() < begin + 10000) {
    await new Promise(requestAnimationFrame);
  }
  running(false);
  const played = desk.time - start;
  document.body.append(made("pre", { id: "test" }, [renderer.name, played, ...lines].join("\n")));
}

function cannotPlay(error) {
  element("notice").textContent = `This show cannot be played here: ${error.message}`;
  console.error(error);
}
