/** Tap the tempo: the beats follow the taps, by the line that fits them best. */

import { perStudio } from "../shell/hooks.js";
import { recount } from "./beats.js";

const MIN_TAPS = 4;
const FIRST_GAP_S = 3.2; // after the first tap: the slowest tempo has a beat each 3 s
const GAP_RATIO = 2.4; // of the time between taps: a longer pause ends them
const SHORTEST_GAP_S = 1;
export const [SLOWEST_TEMPO, FASTEST_TEMPO] = [20, 300]; // counts a minute

/** The taps of a studio. */
export const tapsOf = perStudio((studio) => new Taps(studio));

/**
 * The line that fits taps best, where one may be missing: {start, beat} in seconds, the first tap's time and what is between two.
 * @param {number[]} times increasing, two or more
 */
export function fitted(times) {
  const gaps = times.slice(1).map((time, i) => time - times[i]);
  const usual = gaps.slice().sort((a, b) => a - b)[gaps.length >> 1];
  const counts = [0];
  for (const gap of gaps) counts.push(counts[counts.length - 1] + Math.max(Math.round(gap / usual), 1));
  const mean = (/** @type {number[]} */ values) => values.reduce((sum, one) => sum + one, 0) / values.length;
  const [count, time] = [mean(counts), mean(times)];
  const beat = mean(counts.map((one, i) => (one - count) * (times[i] - time))) / mean(counts.map((one) => (one - count) ** 2));
  return { start: time - count * beat, beat };
}

/** Fires "change" with each tap, and when they end. */
class Taps extends EventTarget {
  /** @type {number[]} */
  #times = [];
  #played = false; // whether these are times of the piece, which plays, or else of the clock
  #ending = 0; // the timer

  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    this.moved = 0; // the clock when the playhead came where it is, seconds
    studio.viewer.player.addEventListener("change", () => (this.moved = performance.now() / 1000));
  }

  get count() {
    return this.#times.length;
  }

  /** Counts a minute, to a tenth; 0 after a single tap. */
  get tempo() {
    return this.count > 1 ? Math.round(600 / fitted(this.#times).beat) / 10 : 0;
  }

  /**
   * Take a tap.
   * @param {number} at the clock, milliseconds as of `performance.now()`
   * @param {any} sound that plays, if any
   */
  tap(at, sound) {
    const { player, isHome } = this.studio.viewer;
    const now = at / 1000;
    const played = player.playing && isHome;
    const heard = sound?.heard;
    const since = heard === undefined ? now - this.moved : now - performance.now() / 1000;
    const time = played ? (heard ?? player.time) + since * player.speed : now;
    if (played !== this.#played || time <= this.#times[this.count - 1]) this.#times = []; // as of another loop
    this.#played = played;
    this.#times.push(time);
    clearTimeout(this.#ending);
    this.#ending = setTimeout(() => this.#end(), 1000 * this.#gap);
    this.dispatchEvent(new Event("change"));
  }

  /** How long to wait for another tap, seconds. */
  get #gap() {
    if (this.count < 2) return FIRST_GAP_S;
    const { speed } = this.studio.viewer.player;
    return Math.max((GAP_RATIO * fitted(this.#times).beat) / (this.#played ? speed : 1), SHORTEST_GAP_S);
  }

  #end() {
    const { studio, tempo } = this;
    const [times, played] = [this.#times, this.#played];
    this.#times = [];
    this.dispatchEvent(new Event("change"));
    if (times.length < MIN_TAPS) {
      if (times.length > 1) studio.say(`Tap ${MIN_TAPS} beats or more.`, { kind: "note" });
    } else if (tempo < SLOWEST_TEMPO || tempo > FASTEST_TEMPO) {
      studio.say(`Tapped ${tempo} a minute: a tempo is ${SLOWEST_TEMPO} to ${FASTEST_TEMPO}.`, { kind: "note" });
    } else this.#keep(tempo, played ? fitted(times).start : null);
  }

  /** @param {number} tempo @param {number | null} start time of the piece of the first tap; null if it did not play */
  #keep(tempo, start) {
    const { studio } = this;
    return studio.act(async () => {
      await studio.api.changed;
      const { state } = studio.store;
      const edit = recount(state, { tempo }, start === null || !state.music.path ? undefined : start + state.music.begins);
      if (edit) await studio.api.edit(edit);
    });
  }
}
