// The desk: time, cues, faders, and what is told about them.

const show = JSON.parse(document.getElementById("show").textContent);
const element = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

function clock(seconds, digits = 1) {
  const unit = 10 ** digits, whole = Math.round(seconds * unit);
  const s = whole / unit, minutes = Math.floor(s / 60), hours = Math.floor(minutes / 60);
  const two = (n) => String(n).padStart(2, "0");
  const rest = (s - 60 * minutes).toFixed(digits).padStart(digits ? digits + 3 : 2, "0");
  return hours ? `${hours}:${two(minutes % 60)}:${rest}` : `${minutes}:${rest}`;
}

function made(tag, options = {}, ...children) {
  const out = document.createElement(tag);
  for (const [name, value] of Object.entries(options)) {
    if (name in out) out[name] = value; else out.setAttribute(name, value);
  }
  out.append(...children);
  return out;
}

const length = show.end - show.start;
const percent = (level) => Math.round(level * 100);
const cueName = (i) => `${show.cues[i].number}${show.cues[i].label ? " " + show.cues[i].label : ""}`;

/// The show's state; everything on the page follows from it.
const desk = { ...standing(show), playing: false, held: new Map(), renderer: null, dirty: true };

/// The last cue that has begun; -1 before the first.
function cueAt(time) {
  let found = -1;
  show.cues.forEach((cue, i) => { if (cue.go <= time + 1e-6) found = i; });
  return found;
}

/// The sum that shows faders held by hand: every picture that is lit, by its setting. Null while
/// none is held: then the keys are blended. (A sum alone, since taking a lamp's 8 bits away from a
/// key's would leave the rounding of both.)
function sumAt(settings) {
  if (desk.held.size === 0 && !desk.rest) return null;
  const setting = ({ law }, i) => (desk.held.has(i) ? settingOf(law, desk.held.get(i)) : settings[i]);
  const terms = show.coordinates.map((c, i) => ({ picture: c.picture, weight: setting(c, i) }));
  return terms.filter(({ weight }) => weight !== 0);
}

// ---- what can be done -------------------------------------------------------------------------

/// To a moment of the sequence; the cue that stands there is the one that GO goes on from.
function seek(time) {
  const to = Math.min(Math.max(time, show.start), show.end);
  Object.assign(desk, { time: to, until: show.end, rest: null, cue: cueAt(to), dirty: true });
}

function play(on) {
  if (on && desk.time >= show.end - 1e-6) seek(show.start);
  if (on) Object.assign(desk, { until: show.end, rest: null });
  running(on);
  desk.sequence = on;
}

function running(on) {
  desk.playing = on;
  desk.sequence = false;
  desk.last = undefined;
  element("play").textContent = on ? "Pause" : "Play";
  element("play").setAttribute("aria-pressed", String(on));
  desk.dirty = true;
}

/// The cue that GO runs; -1 after the last.
function nextCue() {
  return desk.cue + 1 < show.cues.length ? desk.cue + 1 : -1;
}

function go() {
  if (!pressGo(show, desk)) return tell("That was the last cue.");
  tell(`Cue ${cueName(desk.cue)}`);
  running(true);
}

function back() {
  pressBack(show, desk);
  running(false);
  tell(desk.cue >= 0 ? `Cue ${cueName(desk.cue)}, complete` : "Start");
}

/// The light stays where it is; GO goes on from there.
function stop() {
  running(false);
  tell("Stopped");
}

function toCue(i) {
  if (i < 0 || i >= show.cues.length) return;
  running(false);
  seek(show.cues[i].go);
  tell(`Cue ${cueName(i)}, at its start`);
}

function hold(i, level) {
  desk.held.set(i, level);
  desk.dirty = true;
}

function release(i) {
  if (i === undefined) desk.held.clear(); else desk.held.delete(i);
  desk.dirty = true;
  tell(i === undefined ? "All faders released" : `${show.coordinates[i].name} released`);
}

let telling;
function tell(text) {
  clearTimeout(telling);
  telling = setTimeout(() => { element("told").textContent = text; }, 150);
}

// ---- what stands on the page -------------------------------------------------------------------

const rows = [];
const cueRows = [];

function curvePath(i) {
  const points = [];
  // Both sides of every segment's ends, so that jumps are upright.
  for (const segment of show.segments) {
    const steps = segment.degree < 2 ? 1 : 16;
    for (let k = 0; k <= steps; k++) {
      const t = k / steps;
      const [f0, f1, f2] = factors(segment.degree, t);
      const [a, b, c, d] = fourKeys(segment.keys).map((key) => show.settings[key][i]);
      const mixed = (x, y, f) => x + f * (y - x);
      const value = mixed(mixed(a, b, f0), mixed(c, d, f1), f2);
      const time = segment.start + t * (segment.end - segment.start);
      const x = length > 0 ? 1000 * (time - show.start) / length : 0;
      points.push(`${x.toFixed(2)} ${(100 - 100 * levelOf(show.coordinates[i].law, value)).toFixed(2)}`);
    }
  }
  return "M" + points.join("L");
}

function curve(i) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 -3 1000 106");
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("aria-hidden", "true");
  const line = curvePath(i);
  const parts = [["area", "path", { d: `${line}L1000 100L0 100Z` }], ["edge", "path", { d: line }],
    ["hand", "line", { x1: 0, x2: 1000, y1: 0, y2: 0 }], ["now", "line", { x1: 0, x2: 0, y1: -3, y2: 103 }]];
  for (const [kind, tag, attributes] of parts) {
    const part = document.createElementNS(SVG, tag);
    part.setAttribute("class", kind);
    for (const [name, value] of Object.entries(attributes)) part.setAttribute(name, value);
    const colour = show.coordinates[i].colour;
    if (colour && kind === "edge") part.style.stroke = colour;
    if (colour && kind === "area") { part.style.fill = colour; part.style.fillOpacity = 0.25; }
    svg.append(part);
  }
  return svg;
}

function buildBanks() {
  const list = element("banks");
  show.coordinates.forEach((coordinate, i) => {
    if (!coordinate.varies) return;
    const id = `bank-${i}`;
    const label = made("label", { htmlFor: id, title: coordinate.name }, coordinate.name);
    const fader = made("input", { id, type: "range", min: 0, max: 100, step: 1, value: 0 });
    const output = made("output", { htmlFor: id });
    const svg = curve(i);
    const row = made("div", { className: "bank" }, label, fader, output, svg);
    fader.addEventListener("input", () => hold(i, fader.value / 100));
    fader.addEventListener("dblclick", () => release(i));
    fader.addEventListener("keydown", (event) => {
      if (event.key === "Escape" || event.key === "Delete") release(i);
    });
    const drag = (event) => {
      const box = svg.getBoundingClientRect();
      running(false);
      seek(show.start + length * (event.clientX - box.left) / box.width);
    };
    svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); drag(event); });
    svg.addEventListener("pointermove", (event) => { if (event.buttons & 1) drag(event); });
    list.append(row);
    rows.push({ i, row, fader, output, hand: svg.querySelector(".hand"), now: svg.querySelector(".now") });
  });
}

function buildCues() {
  show.cues.forEach((cue, i) => {
    const name = made("span", { className: "name" }, cue.label || "");
    if (i > 0 && show.cues[i - 1].starts) name.prepend(made("i", { title: "starts by itself" }, "\u21b3 "));
    const when = made("span", { className: "when" }, clock(cue.go, cue.go % 1 ? 1 : 0));
    const about = [cue.timing, cue.note].filter(Boolean).join(" \u00b7 ");
    const button = made("button", { type: "button" }, made("b", {}, cue.number), name, when,
      made("span", { className: "about" }, about), made("span", { className: "done" }));
    button.setAttribute("aria-label", `Cue ${cueName(i)}, at ${clock(cue.go)}, time ${about}`);
    button.addEventListener("click", () => toCue(i));
    const item = made("li", {}, button);
    element("cues").append(item);
    cueRows.push(button);
    if (length > 0) {
      const mark = made("i");
      mark.style.left = `${100 * (cue.go - show.start) / length}%`;
      element("marks").append(mark);
    }
  });
}

/// Everything but the picture, to the desk's state.
function refresh(settings) {
  const { time } = desk;
  const current = desk.cue, next = nextCue();
  const left = desk.playing && !desk.sequence ? remaining(desk) : 0;
  element("left").textContent = left > 0 ? `${clock(left)} to go` : "";
  element("clock").textContent = clock(time);
  const scrub = element("scrub");
  scrub.value = time;
  scrub.setAttribute("aria-valuetext", `${clock(time)}${current >= 0 ? ", cue " + cueName(current) : ""}`);
  element("current").textContent = current >= 0 ? `Cue ${cueName(current)}` : "";
  element("picture").setAttribute("aria-label", `The stage at ${clock(time)}${current >= 0 ? ", cue " + cueName(current) : ""}`);
  cueRows.forEach((button, i) => {
    const { go: from, complete } = show.cues[i];
    const done = complete > from ? (time - from) / (complete - from) : Number(time >= from);
    button.style.setProperty("--done", i === current ? `${100 * Math.min(Math.max(done, 0), 1)}%` : "0%");
    button.classList.toggle("next", i === next);
    if (i === current && button.getAttribute("aria-current") === null) {
      button.setAttribute("aria-current", "step");
      const list = element("cues"), top = button.offsetTop - list.offsetTop;
      if (top < list.scrollTop || top + button.offsetHeight > list.scrollTop + list.clientHeight) list.scrollTop = top - list.clientHeight / 2;
    } else if (i !== current) button.removeAttribute("aria-current");
  });
  const changed = [];
  const playhead = length > 0 ? 1000 * (time - show.start) / length : 0;
  for (const { i, row, fader, output, hand, now } of rows) {
    const { law, name } = show.coordinates[i];
    const sheet = levelOf(law, settings[i]), held = desk.held.get(i);
    const level = held ?? sheet;
    row.classList.toggle("held", held !== undefined);
    output.textContent = percent(level);
    if (held === undefined || document.activeElement !== fader) fader.value = percent(level);
    fader.setAttribute("aria-valuetext", held === undefined ? `${percent(level)} percent` : `${percent(level)} percent, held; the sheet says ${percent(sheet)}`);
    for (const end of ["y1", "y2"]) hand.setAttribute(end, 100 - 100 * level);
    for (const end of ["x1", "x2"]) now.setAttribute(end, playhead);
    if (held !== undefined) changed.push(`${name} ${percent(sheet)} \u2192 ${percent(held)}`);
  }
  element("changed").textContent = changed.length ? `Held: ${changed.join(", ")}` : "Move a fader to mix by hand.";
  element("changed").classList.toggle("held", changed.length > 0);
  element("release").hidden = changed.length === 0;
}

function frame(now) {
  if (desk.playing) {
    const passed = desk.last === undefined ? 0 : (now - desk.last) / 1000;
    desk.last = now;
    if (!goOn(show, desk, passed)) running(false);
    if (desk.sequence) desk.cue = cueAt(desk.time);
    desk.dirty = true;
  }
  if (desk.dirty && desk.renderer) {
    desk.dirty = false;
    const moment = momentAt(show, desk.time);
    const light = lightOf(show, desk);
    desk.renderer.draw(moment, sumAt(light));
    refresh(light);
  }
  requestAnimationFrame(frame);
}

function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || !desk.renderer) return;
  const at = event.target, slider = at instanceof HTMLInputElement;
  const step = event.shiftKey ? 0.1 : 1;
  const current = cueAt(desk.time);
  const actions = {
    " ": go, g: go, b: back, s: stop, Escape: stop, p: () => play(!desk.playing), r: () => release(),
    f: () => element("frame").requestFullscreen?.(),
    ...(slider ? {} : {
      ArrowLeft: () => { running(false); seek(desk.time - step); },
      ArrowRight: () => { running(false); seek(desk.time + step); },
      ArrowUp: () => toCue(desk.time > (show.cues[current]?.go ?? show.start) + 1e-6 ? current : current - 1),
      ArrowDown: () => toCue(current + 1),
      Home: () => { running(false); seek(show.start); },
      End: () => { running(false); seek(show.end); },
    }),
  };
  const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action || event.key === "Escape" && slider) return;
  event.preventDefault();
  action();
}

function build() {
  const banks = show.coordinates.filter((c) => c.varies).length;
  const counted = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
  element("facts").textContent = `${counted(show.cues.length, "cue")}, ${counted(banks, "bank")}, ${clock(length, 0)}`;
  element("of").textContent = `of ${clock(show.end)}`;
  element("made").textContent = show.made;
  const scrub = element("scrub");
  Object.assign(scrub, { min: show.start, max: show.end, value: show.start });
  scrub.addEventListener("input", () => { running(false); seek(Number(scrub.value)); });
  scrub.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key];
    if (!by) return;
    event.preventDefault();
    running(false);
    seek(desk.time + by * (event.shiftKey ? 0.1 : 1));
  });
  element("go").addEventListener("click", go);
  element("back").addEventListener("click", back);
  element("stop").addEventListener("click", stop);
  element("full").addEventListener("click", () => element("frame").requestFullscreen?.());
  element("play").addEventListener("click", () => play(!desk.playing));
  element("release").addEventListener("click", () => release());
  for (const { i, fader } of (buildBanks(), rows)) {
    fader.addEventListener("change", () => desk.held.has(i) && tell(`${show.coordinates[i].name} held at ${percent(desk.held.get(i))}`));
  }
  buildCues();
  document.addEventListener("keydown", onKey);
  // A button takes Space when the key is let go.
  document.addEventListener("keyup", (event) => event.key === " " && event.preventDefault());
}
