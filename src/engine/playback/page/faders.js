// The banks: a fader for each. A bank of colour mixers has one for its level, and a control for its
// colour; what is held by hand is kept as the light of its three emitters.

const SVG = "http://www.w3.org/2000/svg";
let faders = [];

/// A colour of the display, `#rrggbb`, of linear shares of red, green and blue; and back.
function hexOf(colour) {
  const code = (v) => Math.round(255 * coded(Math.min(Math.max(v, 0), 1))).toString(16).padStart(2, "0");
  return "#" + colour.map(code).join("");
}
function colourOf(hex) {
  return [1, 3, 5].map((at) => decodedLight(parseInt(hex.slice(at, at + 2), 16) / 255));
}

const sameMix = (a, b) => percent(a.level) === percent(b.level) && (!a.colour || hexOf(a.colour) === hexOf(b.colour));
const mixText = ({ level, colour }) => percent(level) + (colour ? " " + hexOf(colour) : "");

/// Level and colour of light: as the sheet says them, or, where other light is on top, as bright as
/// the light is.
function mixOfLight({ law, mixer }, light, sheet) {
  if (!mixer) return { level: levelOf(law, light[0]) };
  const most = Math.max(...light);
  if (most <= 0) return { level: 0, colour: sheet.colour };
  const part = Math.min(most / Math.max(...sheet.colour, 1e-6), 1);
  return { level: levelOf(law, part), colour: light.map((v) => v / part) };
}

/// What the cues give a bank now, and what it is at.
function mixesOf(fader, settings) {
  const { first, count, mixer } = fader;
  const light = settings.slice(first, first + count);
  const written = mixer && mixAt(mixer.track, desk.time);
  const sheet = mixer && !desk.rest ? written : mixOfLight(fader, light, written);
  if (!isHeld(fader)) return { sheet, now: sheet };
  const held = light.map((setting, c) => desk.held.get(first + c) ?? setting);
  const now = mixer ? fader.kept ?? mixOfLight(fader, held, written) : { level: held[0] };
  return { sheet, now };
}

function isHeld({ first, count }) {
  for (let c = 0; c < count; c++) if (desk.held.has(first + c)) return true;
  return false;
}

function hold(fader, mix) {
  const light = settingOf(fader.law, mix.level);
  fader.kept = mix;
  desk.moved = true;
  if (fader.mixer) mix.colour.forEach((share, c) => desk.held.set(fader.first + c, light * share));
  else desk.held.set(fader.first, mix.level);
  desk.dirty = true;
}

function release(fader) {
  for (const one of fader ? [fader] : faders) {
    one.kept = null;
    for (let c = 0; c < one.count; c++) desk.held.delete(one.first + c);
  }
  Object.assign(desk, { dirty: true, moved: true });
  element("sketched").textContent = "";
  tell(fader ? `${fader.name} released` : "All faders released");
}

// ---- their curves ------------------------------------------------------------------------------

const across = (time) => (length > 0 ? (1000 * (time - show.start) / length).toFixed(2) : 0);
const up = (level) => (100 - 100 * level).toFixed(2);

function curvePath({ first, law, mixer }) {
  if (mixer) return "M" + mixer.track.map(([time, level]) => `${across(time)} ${up(level)}`).join("L") + `H${length > 0 ? 1000 : 0}`;
  const points = [];
  // Both sides of every segment's ends, so that jumps are upright.
  for (const segment of show.segments) {
    const steps = segment.degree < 2 ? 1 : 16;
    for (let k = 0; k <= steps; k++) {
      const t = k / steps;
      const [f0, f1, f2] = factors(segment.degree, t);
      const [a, b, c, d] = fourKeys(segment.keys).map((key) => show.settings[key][first]);
      const mixed = (x, y, f) => x + f * (y - x);
      const value = mixed(mixed(a, b, f0), mixed(c, d, f1), f2);
      points.push(`${across(segment.start + t * (segment.end - segment.start))} ${up(levelOf(law, value))}`);
    }
  }
  return "M" + points.join("L");
}

function drawn(tag, attributes, ...children) {
  const out = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) out.setAttribute(name, value);
  out.append(...children);
  return out;
}

/// The colours of a bank of mixers over time.
function colours({ first, mixer }) {
  const stops = mixer.track.map(([time, , ...colour]) =>
    drawn("stop", { offset: length > 0 ? (time - show.start) / length : 0, "stop-color": hexOf(colour) }));
  return drawn("linearGradient", { id: `colours-${first}`, gradientUnits: "userSpaceOnUse", x1: 0, x2: 1000, y1: 0, y2: 0 }, ...stops);
}

function curve(fader) {
  const line = curvePath(fader);
  const svg = drawn("svg", { viewBox: "0 -3 1000 106", preserveAspectRatio: "none", "aria-hidden": "true" });
  const area = drawn("path", { class: "area", d: `${line}L1000 100L0 100Z` });
  if (fader.mixer) {
    svg.append(colours(fader));
    area.style.fill = `url(#colours-${fader.first})`;
  }
  svg.append(area, drawn("path", { class: "edge", d: line }),
    drawn("line", { class: "hand", x1: 0, x2: 1000, y1: 0, y2: 0 }), drawn("line", { class: "now", x1: 0, x2: 0, y1: -3, y2: 103 }));
  const drag = (event) => {
    if (desk.follows) return;
    const box = svg.getBoundingClientRect();
    running(false);
    seek(show.start + length * (event.clientX - box.left) / box.width);
  };
  svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); drag(event); });
  svg.addEventListener("pointermove", (event) => { if (event.buttons & 1) drag(event); });
  return svg;
}

// ---- on the page -------------------------------------------------------------------------------

function buildFader(fader) {
  const { name, first, mixer } = fader, { channel } = show.coordinates[first];
  const id = `bank-${first}`;
  const label = made("label", { htmlFor: id, title: channel === null ? name : `${name}, channel ${channel}` }, name);
  if (channel !== null) label.prepend(made("span", { className: "hidden" }, "channel "), made("span", { className: "channel" }, channel), " ");
  const range = made("input", { id, type: "range", min: 0, max: 100, step: 1, value: 0, disabled: desk.follows });
  // The fader itself tells its level; this would be read out with every frame.
  const output = made("span", { className: "level", "aria-hidden": "true" });
  const svg = curve(fader);
  const named = made("span", { className: "named" }, label);
  const now = () => mixesOf(fader, lightOf(show, desk)).now;
  const heldNow = () => isHeld(fader) && tell(`${name} held at ${mixText(now())}`);
  range.addEventListener("input", () => hold(fader, { ...now(), level: range.value / 100 }));
  range.addEventListener("change", heldNow);
  if (mixer) {
    fader.well = made("input", { type: "color", disabled: desk.follows, "aria-label": `${name}, colour` });
    fader.well.addEventListener("input", () => hold(fader, { ...now(), colour: colourOf(fader.well.value) }));
    fader.well.addEventListener("change", heldNow);
    named.append(fader.well);
  }
  const row = made("div", { className: "bank" }, named, range, output, svg);
  range.addEventListener("dblclick", () => { if (!desk.follows) release(fader); });
  row.addEventListener("keydown", (event) => {
    if (!desk.follows && (event.key === "Escape" || event.key === "Delete")) release(fader);
  });
  element("banks").append(row);
  Object.assign(fader, { row, range, output, hand: svg.querySelector(".hand"), playhead: svg.querySelector(".now") });
}

function buildFaders() {
  faders = [];
  element("banks").replaceChildren();
  const mixers = new Map(show.mixers.map((mixer) => [mixer.first, mixer]));
  for (let i = 0; i < show.coordinates.length;) {
    const { name, law, varies } = show.coordinates[i], mixer = mixers.get(i);
    const fader = { name: mixer?.name ?? name, first: i, count: mixer ? 3 : 1, law: mixer?.law ?? law, mixer, kept: null };
    i += fader.count;
    if (!varies) continue;
    faders.push(fader);
    buildFader(fader);
  }
}

function refreshFaders(settings) {
  const changed = [];
  for (const fader of faders) {
    const { row, range, output, well, hand, playhead } = fader;
    const { sheet, now } = mixesOf(fader, settings), held = isHeld(fader);
    row.classList.toggle("held", held);
    output.textContent = percent(now.level);
    if (!held || document.activeElement !== range) range.value = percent(now.level);
    if (well && document.activeElement !== well) well.value = hexOf(now.colour);
    range.setAttribute("aria-valuetext", held ? `${percent(now.level)} percent, held; the sheet says ${percent(sheet.level)}` : `${percent(now.level)} percent`);
    for (const end of ["y1", "y2"]) hand.setAttribute(end, 100 - 100 * now.level);
    for (const end of ["x1", "x2"]) playhead.setAttribute(end, across(desk.time));
    if (held && !sameMix(sheet, now)) changed.push(`${fader.name} ${mixText(sheet)} \u2192 ${mixText(now)}`);
  }
  const held = desk.held.size > 0;
  element("changed").textContent = held ? `Held: ${changed.join(", ") || "as the sheet says"}` : desk.follows ? "" : "Move a fader to mix by hand; a double click lets it go.";
  element("changed").classList.toggle("held", held);
  element("release").hidden = !held || desk.follows;
}
