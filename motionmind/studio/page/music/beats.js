/** Counts: when each comes, by the beats of the music or else by an even tempo. Nothing here knows a view. */

/**
 * How the piece is counted.
 * @typedef {{tempo: number, counts: number, beats?: number[], first?: number}} Meter counts a minute, and counts of a phrase;
 *   times of the music's beats, two or more, seconds of the piece, and the index of the one that is count 1
 * @typedef {{path: string, begins: number, beats: number[], first: number}} Music as in the project: the beats are in its own time
 */

/** @type {{told: any, text: string, meter: Meter}} */
let latest = { told: null, text: "", meter: { tempo: 120, counts: 8 } };

/** The meter of a project's state; an identical one as long as nothing has changed. @param {any} state @returns {Meter} */
export function meterOf(state) {
  if (!state || state === latest.told) return latest.meter;
  const { tempo, counts, music } = state;
  const text = JSON.stringify([tempo, counts, music]);
  const { begins, beats, first } = music;
  const own = beats.length > 1 ? { beats: beats.map((/** @type {number} */ time) => time - begins), first } : {};
  latest = { told: state, text, meter: text === latest.text ? latest.meter : { tempo, counts, ...own } };
  return latest.meter;
}

/** The index of the last value that is no greater than `value`, or 0. @param {number[]} values increasing */
function before(values, value) {
  let [low, high] = [0, values.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (values[middle] <= value) low = middle;
    else high = middle;
  }
  return low;
}

/**
 * The time of a count, from 0: between two beats in proportion, and beyond the first or last two as far apart as they are.
 * @param {number} count @param {Meter} meter
 */
export function timeOf(count, { tempo, beats, first = 0 }) {
  if (!beats) return (count * 60) / tempo;
  const at = Math.min(Math.max(Math.floor(count + first), 0), beats.length - 2);
  return beats[at] + (count + first - at) * (beats[at + 1] - beats[at]);
}

/** The count at a time, from 0, with fractions. @param {number} time @param {Meter} meter */
export function countOf(time, { tempo, beats, first = 0 }) {
  if (!beats) return (time * tempo) / 60;
  const at = Math.min(before(beats, time), beats.length - 2);
  return at - first + (time - beats[at]) / (beats[at + 1] - beats[at]);
}

/**
 * The edit that counts by another tempo, or in other phrases; null if nothing changes. Another tempo than the music's counts
 * evenly from the same count 1, or from `start`, seconds of the music.
 * @param {{tempo: number, counts: number, music: Music}} state @param {{tempo?: number, counts?: number}} change
 * @param {number} [start]
 */
export function recount({ tempo, counts, music }, change, start) {
  const next = { tempo, counts, ...change };
  if (next.tempo === tempo && next.counts === counts && start === undefined) return null;
  const edit = { edit: "tempo", ...next };
  if (!music.path || (next.tempo === tempo && start === undefined)) return edit;
  const first = start ?? music.beats[music.first] ?? music.begins;
  return { edit: "several", words: "change the tempo", edits: [evenly(music, first, next.tempo), edit] };
}

/** Have music counted evenly, with count 1 at `start`. @param {Music} music */
function evenly({ path, begins }, start, tempo) {
  return { edit: "music", path, begins, beats: [start, start + 60 / tempo], first: 0 };
}
