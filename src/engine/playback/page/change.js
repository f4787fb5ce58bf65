// Another version of the show in place of the one that is shown, with the desk where it was.

const indexOf = (version, name) => version.coordinates.findIndex((c) => c.name === name);
const cueOf = (version, number) => version.cues.findIndex((cue) => cue.number === number);

/// The desk's place in the next version: in the same cue, as long after its GO; complete if it was.
function carryOver(next) {
  const cue = cueOf(next, show.cues[desk.cue]?.number);
  const named = (list) => next.coordinates.map((c) => list[indexOf(show, c.name)] ?? 0);
  const held = [...desk.held].map(([i, level]) => [indexOf(next, show.coordinates[i].name), level]);
  const rest = desk.rest && { light: named(desk.rest.light), lasts: named(desk.rest.lasts) };
  Object.assign(desk, { held: new Map(held.filter(([i]) => i >= 0)), rest });
  if (cue < 0 || desk.sequence) {
    desk.time = Math.min(Math.max(desk.time, next.start), next.end);
    return Object.assign(desk, { cue, until: desk.sequence ? next.end : desk.time });
  }
  const until = settled(next, lastOf(next, cue)), complete = desk.time >= settled(show, lastOf(show, desk.cue)) - 1e-6;
  const time = complete ? until : Math.min(desk.time - show.cues[desk.cue].go + next.cues[cue].go, next.end);
  Object.assign(desk, { cue, time, until: Math.max(until, time) });
}

/// All of a version but its pictures.
const words = ({ pictures, ...rest }) => JSON.stringify(rest);

/// Shows another version, at once where all of it is here.
async function change(next) {
  const fits = String(next.size) === String(show.size) && next.curve === show.curve;
  const renderer = fits ? desk.renderer : rendererFor(next, element("picture").cloneNode());
  const taken = [];
  await load(next, renderer.wantsPixels, fits ? show.pictures : [], (...picture) => taken.push(picture));
  for (const picture of taken) renderer.take(...picture);
  const same = words(next) === words(show);
  if (!same) carryOver(next);
  if (!fits) element("picture").replaceWith(renderer.canvas);
  show = next;
  length = show.end - show.start;
  desk.renderer = renderer;
  if (!same) fill();
  pictured = 0;
  desk.dirty = true;
  desk.changed?.();
}
