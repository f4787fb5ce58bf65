// The desk: time, cues, and what is told about them.

/// The show, and its length in seconds; of a page that is served the version of now.
let show = null, length = 0;
const element = (id) => document.getElementById(id);

function clock(seconds, digits = 1) {
  const unit = 10 ** digits, whole = Math.round(seconds * unit);
  const s = whole / unit, minutes = Math.floor(s / 60), hours = Math.floor(minutes / 60);
  const two = (n) => String(n).padStart(2, "0");
  const rest = (s - 60 * minutes).toFixed(digits).padStart(digits ? digits + 3 : 2, "0");
  return hours ? `${hours}:${two(minutes % 60)}:${rest}` : `${minutes}:${rest}`;
}

/// Seconds that are left, a countdown.
const seconds = (left) => (left < 60 ? `${left.toFixed(1)} s` : clock(left));

function made(tag, options = {}, ...children) {
  const out = document.createElement(tag);
  for (const [name, value] of Object.entries(options)) {
    if (name in out) out[name] = value; else out.setAttribute(name, value);
  }
  out.append(...children);
  return out;
}

const percent = (level) => Math.round(level * 100);
const cueName = (i) => `${show.cues[i].number}${show.cues[i].label ? " " + show.cues[i].label : ""}`;

/// The show's state; everything on the page follows from it. `moved` says that a person changed it,
/// `follows` that this page only looks on.
const desk = { playing: false, held: new Map(), grand: 1, isDark: false, renderer: null, dirty: true, moved: false, follows: false };

/// The last cue that has begun; -1 before the first.
function cueAt(time) {
  let found = -1;
  show.cues.forEach((cue, i) => { if (cue.go <= time + 1e-6) found = i; });
  return found;
}

/// The sum of every picture that is lit, by its setting.
function sumOf(settings) {
  const terms = show.coordinates.map((c, i) => ({ picture: show.keys + c.picture, weight: settings[i] }));
  return terms.filter(({ weight }) => weight !== 0);
}

/// The keys of a moment, each with its weight.
function keysOf({ keys, factors: [f0, f1, f2] }) {
  const weights = [(1 - f2) * (1 - f0), (1 - f2) * f0, f2 * (1 - f1), f2 * f1];
  return weights.map((weight, k) => ({ picture: keys[k], weight }));
}

/// The sum that shows faders held by hand. Null while none is held: then the keys are blended, where
/// the page has them. (A sum alone, since taking a lamp's 8 bits away from a key's would leave the
/// rounding of both. But only keys have moving heads where they are, so with heads the change by hand
/// is added to them.)
function sumAt(settings, moment) {
  if (show.keys > 0 && desk.held.size === 0 && !desk.rest) return null;
  const held = settings.map((setting, i) => (desk.held.has(i) ? settingOf(show.coordinates[i].law, desk.held.get(i)) : setting));
  if (!show.heads) return sumOf(held);
  return [...keysOf(moment), ...sumOf(held.map((setting, i) => setting - moment.settings[i]))];
}

/// The level of everything that cues move.
const grandLevel = () => (desk.isDark ? 0 : desk.grand);

/// What is drawn of a moment behind the grand master, which the fixed lights do not follow.
function behindGrand(moment, light, sum) {
  const level = grandLevel();
  if (level === 1) return sum;
  const scaled = (sum ?? keysOf(moment)).map(({ picture, weight }) => ({ picture, weight: weight * level }));
  const fixed = sumOf(light.map((setting, i) => (show.coordinates[i].varies ? 0 : setting * (1 - level))));
  return [...scaled, ...fixed].filter(({ weight }) => weight !== 0);
}

function setGrand(level, isDark = false) {
  Object.assign(desk, { grand: Math.min(Math.max(level, 0), 1), isDark, dirty: true, moved: true });
  tell(isDark ? "Blackout" : `Grand master ${percent(desk.grand)}`);
}

/// The other of dark and light, whichever the page has now.
function switchScheme() {
  const is = document.documentElement.style.colorScheme || (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark");
  document.documentElement.style.colorScheme = is === "light" ? "dark" : "light";
}

// ---- what can be done -------------------------------------------------------------------------

/// To a moment of the sequence; the cue that stands there is the one that GO goes on from, and its
/// fades have until it is complete.
function seek(time) {
  const to = Math.min(Math.max(time, show.start), show.end), cue = cueAt(to);
  const until = cue < 0 ? to : Math.max(settled(show, cue), to);
  Object.assign(desk, { time: to, until, rest: null, cue, dirty: true, moved: true });
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
  Object.assign(desk, { dirty: true, moved: true });
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
  if (i < 0 || i >= show.cues.length || desk.follows) return;
  running(false);
  seek(show.cues[i].go);
  tell(`Cue ${cueName(i)}, at its start`);
}

let telling;
function tell(text) {
  clearTimeout(telling);
  telling = setTimeout(() => { element("told").textContent = text; }, 150);
}

// ---- what stands on the page -------------------------------------------------------------------

let cueRows = [];

function buildCues() {
  cueRows = [];
  for (const id of ["cues", "marks"]) element(id).replaceChildren();
  show.cues.forEach((cue, i) => {
    const thumbnail = made("canvas", { width: 160, height: Math.round(160 * show.size[1] / show.size[0]) });
    const byItself = i > 0 && show.cues[i - 1].starts;
    const name = made("span", { className: "name" }, made("span", { className: "hidden" }, "Cue "),
      made("b", {}, cue.number), ` ${cue.label}`);
    const timing = made("span", { className: "timing" });
    if (byItself) {
      const arrow = made("span", {}, "\u21b3 ");
      arrow.setAttribute("aria-hidden", "true");
      timing.append(arrow, made("span", { className: "hidden" }, "starts by itself, "));
      timing.title = "starts by itself";
    }
    timing.append(cue.timing);
    const when = made("span", { className: "when" });
    const complete = made("span", { className: "complete", title: "when it is complete" });
    if (cue.complete > cue.go) complete.append(made("span", { className: "hidden" }, "complete at "), `\u2192 ${clock(cue.complete, cue.complete % 1 ? 1 : 0)}`);
    const button = made("button", { type: "button" }, thumbnail, name, when, timing, complete,
      made("span", { className: "note" }, cue.note), made("span", { className: "done" }));
    thumbnail.setAttribute("aria-hidden", "true");
    button.addEventListener("click", () => toCue(i));
    element("cues").append(made("li", {}, button));
    cueRows.push({ button, when, thumbnail });
    if (length > 0) {
      const mark = made("i");
      mark.style.left = `${100 * (cue.go - show.start) / length}%`;
      element("marks").append(mark);
    }
  });
}

let pictured = 0;
/// Draws the next cues, complete, into their rows, within these milliseconds. The picture itself
/// must be drawn again before it is seen.
function drawThumbnails(milliseconds) {
  const until = performance.now() + milliseconds;
  while (pictured < cueRows.length && performance.now() < until) {
    const { thumbnail } = cueRows[pictured];
    const moment = momentAt(show, settled(show, pictured));
    desk.renderer.draw(moment, show.keys > 0 ? null : sumOf(moment.settings));
    thumbnail.getContext("2d").drawImage(element("picture"), 0, 0, thumbnail.width, thumbnail.height);
    pictured++;
    desk.dirty = true;
  }
}

/// What stands at a cue's right: the seconds that it has left, or until it starts by itself; else
/// when its GO is.
function whenOf(i, current) {
  const { go: from, complete, starts } = show.cues[i];
  if (i === current && complete > desk.time) return seconds(complete - desk.time);
  const follows = current >= 0 && i === current + 1 && show.cues[current].starts;
  if (follows && desk.playing) return `in ${seconds(Math.max(from - desk.time, 0))}`;
  const at = clock(from, from % 1 ? 1 : 0);
  return show.cues[i - 1]?.starts ? at : `GO ${at}`;
}

function refreshCues(current, next) {
  const { time } = desk;
  cueRows.forEach(({ button, when }, i) => {
    const { go: from, complete } = show.cues[i];
    const done = complete > from ? (time - from) / (complete - from) : Number(time >= from);
    button.style.setProperty("--done", i === current ? `${100 * Math.min(Math.max(done, 0), 1)}%` : "0%");
    button.classList.toggle("next", i === next);
    when.textContent = whenOf(i, current);
    if (i === current && button.getAttribute("aria-current") === null) {
      button.setAttribute("aria-current", "step");
      const list = element("cues"), top = button.offsetTop - list.offsetTop;
      if (top < list.scrollTop || top + 2 * button.offsetHeight > list.scrollTop + list.clientHeight) list.scrollTop = top - button.offsetHeight;
    } else if (i !== current) button.removeAttribute("aria-current");
  });
}

/// Everything but the picture, to the desk's state.
function refresh(settings) {
  const { time } = desk;
  const current = desk.cue, next = nextCue();
  const left = desk.playing && !desk.sequence ? remaining(desk) : 0;
  const standing = current >= 0 ? `Cue ${cueName(current)}` : "";
  element("clock").textContent = clock(time);
  const grand = desk.isDark ? "Blackout" : desk.grand < 1 ? `Grand master ${percent(desk.grand)}` : "";
  element("left").textContent = [left > 0 ? `${seconds(left)} left` : "", grand].filter(Boolean).join(", ");
  if (document.activeElement !== element("grand") || !desk.isDark) element("grand").value = percent(desk.grand);
  element("grand-level").textContent = percent(desk.grand);
  element("blackout").setAttribute("aria-pressed", String(desk.isDark));
  element("current").textContent = standing;
  element("next").textContent = next < 0 ? "" : `GO: ${cueName(next)}${show.cues[next].note ? ` (${show.cues[next].note})` : ""}`;
  const scrub = element("scrub");
  scrub.value = time;
  const moment = `${clock(time)}${standing && ", " + standing[0].toLowerCase() + standing.slice(1)}`;
  scrub.setAttribute("aria-valuetext", moment);
  element("picture").setAttribute("aria-label", `The stage at ${moment}`);
  refreshCues(current, next);
  refreshFaders(settings);
}

function frame(now) {
  if (desk.playing) {
    const passed = desk.last === undefined ? 0 : (now - desk.last) / 1000;
    desk.last = now;
    if (!goOn(show, desk, passed)) running(false);
    if (desk.sequence) desk.cue = cueAt(desk.time);
    desk.dirty = true;
  }
  if (!desk.dirty && desk.renderer && !desk.playing) drawThumbnails(8);
  if (desk.dirty && desk.renderer) {
    desk.dirty = false;
    const moment = momentAt(show, desk.time);
    const light = lightOf(show, desk);
    desk.renderer.draw(moment, behindGrand(moment, light, sumAt(light, moment)));
    refresh(light);
  }
  if (desk.moved) {
    desk.moved = false;
    desk.tells?.();
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
    f: () => element("frame").requestFullscreen?.(), d: switchScheme, 0: () => setGrand(desk.grand, !desk.isDark),
    "+": () => setGrand(desk.grand + 0.05), "=": () => setGrand(desk.grand + 0.05), "-": () => setGrand(desk.grand - 0.05),
    ...(slider ? {} : {
      ArrowLeft: () => { running(false); seek(desk.time - step); },
      ArrowRight: () => { running(false); seek(desk.time + step); },
      ArrowUp: () => toCue(desk.time > (show.cues[current]?.go ?? show.start) + 1e-6 ? current : current - 1),
      ArrowDown: () => toCue(current + 1),
      Home: () => { running(false); seek(show.start); },
      End: () => { running(false); seek(show.end); },
    }),
  };
  const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const action = actions[name];
  if (!action || desk.follows && name !== "f" && name !== "d" || event.key === "Escape" && slider) return;
  event.preventDefault();
  // A key that is held down is pressed once, but for arrows, plus and minus.
  if (!event.repeat || /^Arrow|^[-+=]$/.test(event.key)) action();
}

/// What a version of the show says on the page.
function fill() {
  const counted = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
  const focused = document.activeElement?.id, scrolled = element("cues").scrollTop;
  buildFaders();
  document.title = element("title").textContent = show.title;
  element("facts").textContent = `${counted(show.cues.length, "cue")}, ${counted(faders.length, "bank")}, ${clock(length, 0)}`;
  element("of").textContent = `of ${clock(show.end)}`;
  element("quality").textContent = show.quality;
  element("made").textContent = show.made;
  for (const id of ["grand", "blackout", "sketch"]) element(id).disabled = desk.follows;
  Object.assign(element("scrub"), { min: show.start, max: show.end, value: show.start, disabled: desk.follows });
  buildCues();
  element("cues").scrollTop = scrolled;
  if (focused) element(focused)?.focus();
}

/// What is done on the page.
function listen() {
  const scrub = element("scrub");
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
  element("scheme").addEventListener("click", switchScheme);
  element("grand").addEventListener("input", () => setGrand(Number(element("grand").value) / 100));
  element("blackout").addEventListener("click", () => setGrand(desk.grand, !desk.isDark));
  element("release").addEventListener("click", () => release());
  takeSketches();
  document.addEventListener("keydown", onKey);
  // A button takes Space when the key is let go.
  document.addEventListener("keyup", (event) => event.key === " " && event.preventDefault());
}
