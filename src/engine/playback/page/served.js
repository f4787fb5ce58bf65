// A page that is served: the show and what is done with it come as events, and go back from the one
// page that runs the show. The other pages follow it.

const page = JSON.parse(element("show").textContent);
/// Tells this page's own events from those of others.
const own = String(Math.random()).slice(2);
/// What the running page did last, and when that was, by this page's clock.
let followed = null;
/// The version that is wanted, and the one that is shown.
let wanted = 0, shownVersion = 0, isFetching = false;

/// The state of the desk in names, which mean the same in another version of the show.
function stateOfDesk() {
  const passed = desk.playing && desk.last !== undefined ? (performance.now() - desk.last) / 1000 : 0;
  const named = (entries) => Object.fromEntries(entries.map(([i, value]) => [show.coordinates[i].name, value]));
  const { rest, until, playing, sequence } = desk;
  return {
    by: own, cue: show.cues[desk.cue]?.number ?? null, time: desk.time + passed, until, ran: desk.ran + passed, playing,
    sequence: Boolean(sequence), grand: grandLevel(), held: named([...desk.held]),
    rest: rest && named(rest.light.map((light, i) => [i, [light, rest.lasts[i]]]).filter(([, [, lasts]]) => lasts > 0)),
  };
}

/// Does what the running page did.
function follow() {
  const { run, at } = followed, age = (performance.now() - at) / 1000;
  const cue = cueOf(show, run.cue), was = desk.cue;
  const rest = run.rest && { light: show.coordinates.map((c) => run.rest[c.name]?.[0] ?? 0), lasts: show.coordinates.map((c) => run.rest[c.name]?.[1] ?? 0) };
  for (const fader of faders) fader.kept = null;
  running(run.playing);
  const held = Object.entries(run.held).map(([name, level]) => [indexOf(show, name), level]);
  Object.assign(desk, { grand: run.grand ?? 1, isDark: false, cue, time: run.time, until: run.until, ran: run.ran, rest, held: new Map(held.filter(([i]) => i >= 0)) });
  if (run.playing) {
    if (!goOn(show, desk, age)) running(false);
    desk.last = performance.now();
    desk.sequence = run.sequence;
  }
  desk.moved = false;
  if (cue !== was && cue >= 0) tell(`Cue ${cueName(cue)}`);
}

async function fetchShow() {
  if (isFetching) return;
  isFetching = true;
  try {
    while (shownVersion !== wanted) {
      const version = wanted, answer = await fetch("show");
      if (!answer.ok) break;
      const next = await answer.json();
      if (show) await change(next);
      else {
        await openShow(next);
        if (followed) follow();
      }
      shownVersion = version;
    }
  } catch (error) {
    if (!show) cannotPlay(error);
  } finally {
    isFetching = false;
  }
}

function hear({ version, wrong, state, run, age }) {
  element("wrong").hidden = !wrong;
  if (element("wrong").textContent !== wrong) element("wrong").textContent = wrong;
  element("state").textContent = state;
  if (!show) element("notice").textContent = wrong ? "" : state;
  if (run && run.by !== own) {
    const news = JSON.stringify(run) !== JSON.stringify(followed?.run);
    followed = { run, at: performance.now() - 1000 * age };
    if (show && news) follow();
  } else if (run) followed = null;
  wanted = version;
  if (version > 0) fetchShow();
}

let isSending = false, isLeft = false;
async function send() {
  isLeft = true;
  if (isSending) return;
  isSending = true;
  while (isLeft) {
    isLeft = false;
    try {
      await fetch("run", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(stateOfDesk()) });
    } catch { /* The events say that nothing is connected. */ }
  }
  isSending = false;
}

desk.follows = page.follows;
desk.changed = () => {
  if (followed && followed.run.by !== own) follow();
  else if (!page.follows) desk.moved = true;
};
document.body.classList.toggle("follows", page.follows);
if (!page.follows) desk.tells = send;
const events = new EventSource("events");
events.onmessage = (event) => hear(JSON.parse(event.data));
events.onerror = () => {
  element("state").textContent = events.readyState === EventSource.CLOSED ? "The program has ended" : "Not connected; trying again";
};
