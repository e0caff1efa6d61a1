/** The time line's scale and ticks. Nothing here knows a view. */

import { countOf, timeOf } from "../music/beats.js";

const [MIN_SCALE, MAX_SCALE] = [2, 1200]; // pixels a second
const MIN_LABEL_DISTANCE_PX = 64;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600];
const DIGIT_PX = 8;
const COUNT_SLACK = 0.01; // of a count: the project keeps milliseconds
const MAX_VISIBLE = 300; // stretches
const MARGIN_PX = 40; // of a piece shown whole: a posture at its end extends beyond it

/** The scale that fits `seconds` into `width` pixels, unless the stretches would be too crowded. */
export function fitting(seconds, width, stretches) {
  return bounded((width - MARGIN_PX) / Math.max(seconds, 1), seconds, width, stretches);
}

/** Clamp a scale to its bounds. */
export function bounded(scale, seconds, width, stretches) {
  const crowded = (stretches / MAX_VISIBLE) * (width / Math.max(seconds, 1));
  return Math.min(Math.max(scale, MIN_SCALE, Math.min(crowded, MAX_SCALE)), MAX_SCALE);
}

/** @typedef {{scale: number, left: number, width: number}} Sight pixels a second, pixels scrolled past, and width in pixels */

/** Zoom by a factor: the time at `x` pixels from the left edge stays in place. @param {Sight} sight */
export function zoomed({ scale, left, width }, { seconds, blocks }, factor, x) {
  const next = bounded(scale * factor, seconds, width, blocks.length);
  return { scale: next, left: Math.max(((left + x) / scale) * next - x, 0), fits: false };
}

/** A time if it is visible, or else the middle, in pixels from the left edge. @param {Sight} sight */
export function middleOf({ scale, left, width }, time) {
  const x = time * scale - left;
  return x >= 0 && x <= width ? x : width / 2;
}

/** Scroll a stretch of time into view. @param {Sight} sight */
export function revealing({ scale, left, width }, at, seconds) {
  const [from, to] = [at * scale, (at + seconds) * scale];
  const room = Math.min(48, width / 4);
  if (from < left + room) return { left: Math.max(from - room, 0) };
  if (to > left + width - room) return { left: Math.max(Math.min(to - width + room, from - room), 0) };
  return {};
}

/** Ticks of seconds from `from` to `to`: [{at, label}], labels where there is room. */
export function secondTicks(from, to, scale) {
  const step = STEPS_S.find((each) => each * scale >= MIN_LABEL_DISTANCE_PX) ?? 3600;
  const ticks = [];
  for (let i = Math.max(Math.floor(from / step), 0); i * step <= to; i++) {
    ticks.push({ at: i * step, label: clock(i * step, step) });
  }
  return ticks;
}

/** @typedef {import("../music/beats.js").Meter} Meter */

/** Ticks of counts: [{at, label, strong}]; each phrase begins with a strong one. @param {Meter} meter */
export function countTicks(from, to, scale, meter) {
  const { tempo, counts } = meter;
  const beat = 60 / tempo;
  const digits = String(Math.floor(countOf(to, meter) / counts) + 1).length; // of the last phrase
  const room = (each) => (each < counts / 2 ? 26 : 40) + DIGIT_PX * (digits - 1);
  // Parts of a phrase that divide it, then whole phrases: each of these has a strong tick.
  const parts = [1, 2, 4].filter((each) => each < counts && counts % each === 0);
  const steps = [...parts, ...[1, 2, 4, 8, 16, 32].map((each) => each * counts)];
  const every = steps.find((each) => each * beat * scale >= room(each)) ?? 64 * counts;
  const ticks = [];
  for (let i = Math.floor(countOf(from, meter) / every) * every, at; (at = timeOf(i, meter)) <= to; i += every) {
    if (at < 0) continue;
    const { phrase, count } = phrased(i, counts);
    ticks.push({ at, label: count === 1 ? `${phrase}·1` : String(count), strong: count === 1 });
  }
  return ticks;
}

/** A time as a label. */
export function clock(seconds, step = 0.01) {
  const digits = step < 1 ? (step < 0.1 ? 2 : 1) : 0;
  const minutes = Math.floor((seconds + 1e-9) / 60);
  const rest = (seconds - minutes * 60).toFixed(digits);
  return minutes > 0 ? `${minutes}:${rest.padStart(digits ? digits + 3 : 2, "0")}` : `${rest}`;
}

/** The phrase and the count at a time, in words. @param {Meter} meter */
export function countAt(seconds, meter) {
  const { counts } = meter;
  const { phrase, count } = phrased(Math.floor(countOf(seconds, meter) + 1e-6), counts);
  return `${counts === 8 ? "eight" : "phrase"} ${phrase}, count ${count}`;
}

/** The phrase and the count, from 1, of a count from 0; an upbeat, less than 0, is in phrase 0. */
function phrased(/** @type {number} */ count, /** @type {number} */ counts) {
  const phrase = Math.floor(count / counts);
  return { phrase: phrase + 1, count: count - phrase * counts + 1 };
}

/** The time of a whole count, or of the first one in the piece. @param {Meter} meter */
function inPiece(/** @type {number} */ count, meter) {
  return timeOf(Math.max(count, Math.ceil(countOf(0, meter) - 1e-9)), meter);
}

/** The time of the count nearest to a time. @param {Meter} meter */
export function nearestCount(seconds, meter) {
  return inPiece(Math.round(countOf(seconds, meter)), meter);
}

/** The time `by` counts on from a time; between counts, from the one before or after. @param {Meter} meter */
export function countFrom(seconds, by, meter) {
  const count = countOf(seconds, meter);
  const whole = by > 0 ? Math.floor(count + COUNT_SLACK) : Math.ceil(count - COUNT_SLACK);
  return inPiece(whole + by, meter);
}
