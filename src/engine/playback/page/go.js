// What GO does, without a page: the same cues as `go` of the prompt, each once. `run` is the state: the
// last cue that was run, the moment of the sequence, where it is to stop, and the rest of the light
// that stood when GO was pressed.

/// Before the first cue.
function standing(show) {
  return { cue: -1, time: show.start, until: show.start, ran: 0, rest: null };
}

function settingsAt(show, time) {
  return momentAt(show, time).settings;
}

/// What is left of the light at GO in a coordinate; it fades out in the time of the move that takes
/// over, or in what the older fade had left.
function restOf(run, i) {
  if (!run.rest) return 0;
  const { light, lasts } = run.rest;
  return run.ran >= lasts[i] ? 0 : light[i] * (1 - run.ran / lasts[i]);
}

/// The light of every coordinate.
function lightOf(show, run) {
  return settingsAt(show, run.time).map((setting, i) => setting + restOf(run, i));
}

/// The seconds until nothing moves any more.
function remaining(run) {
  const rest = run.rest ? Math.max(...run.rest.lasts) - run.ran : 0;
  return Math.max(run.until - run.time, rest, 0);
}

/// Where a cue is complete, or where the next one takes over from it.
function settled(show, i) {
  const { go, complete } = show.cues[i], next = show.cues[i + 1];
  return next && next.go <= complete && next.go > go ? next.go - 1e-6 : Math.max(complete, go);
}

/// The last of the cues that follow a cue by themselves.
function lastOf(show, i) {
  while (show.cues[i]?.starts && i + 1 < show.cues.length) i++;
  return i;
}

/// Runs the next cue, and those that it starts, from where the light is. False after the last.
function pressGo(show, run) {
  const next = run.cue + 1;
  if (next >= show.cues.length) return false;
  const cue = show.cues[next];
  const light = lightOf(show, run), end = settingsAt(show, run.until), now = settingsAt(show, run.time);
  const before = settingsAt(show, next > 0 ? cue.go - 1e-6 : cue.go);
  const takes = new Map(cue.moves);
  const left = (i) => {
    const older = end[i] === now[i] ? 0 : Math.max(run.until - run.time, 0);
    return Math.max(older, run.rest ? run.rest.lasts[i] - run.ran : 0);
  };
  const lasts = light.map((_, i) => takes.get(i) ?? left(i));
  const rest = light.map((value, i) => (Math.abs(value - before[i]) < 1e-9 ? 0 : value - before[i]));
  run.rest = rest.some((value, i) => value !== 0 && lasts[i] > 0)
    ? { light: rest, lasts: lasts.map((seconds, i) => (rest[i] === 0 ? 0 : seconds)) } : null;
  Object.assign(run, { cue: next, time: cue.go, until: settled(show, lastOf(show, next)), ran: 0 });
  return true;
}

/// So many seconds later. False when nothing moves any more.
function goOn(show, run, seconds) {
  run.time = Math.min(run.time + seconds, Math.max(run.until, run.time));
  run.ran += seconds;
  // Cues that start by themselves.
  while (run.cue + 1 < show.cues.length && show.cues[run.cue]?.starts && show.cues[run.cue + 1].go <= run.time) run.cue++;
  if (remaining(run) > 0) return true;
  run.rest = null;
  return false;
}

/// The look of the cue before, complete.
function pressBack(show, run) {
  const cue = Math.max(run.cue - 1, -1);
  const time = cue < 0 ? show.start : settled(show, cue);
  Object.assign(run, { cue, time, until: time, rest: null });
}
