/** From A to B: both postures, the alternatives found, and the chosen one. It knows no views. */

import { AwayError } from "../api.js";
import { playable } from "../movements.js";
import { Keeper } from "./keeper.js";

export const MAX_ALTERNATIVES = 4;
export const POSTURE_TYPE = "application/x-motionmind-posture"; // of data in a drag

/**
 * @typedef {{key: string, frame: number, last?: number, title: string}} Place
 * @typedef {{begins: number, ends: number, how: string, where: string, key: string, at: number, degrees: number}} Stretch
 * @typedef {{number: number, seconds: number, words: string, differs: string, details: string, sure: string, usual: string,
 *   beyond: string[], joints: Record<string, Stretch[]>}} Account
 */

class Desk extends EventTarget {
  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    /** @type {{a: Place | null, b: Place | null}} */
    this.ends = { a: null, b: null };
    /** @type {Place | null} the posture last picked in the gallery */
    this.choice = null;
    /** @type {{by: Place, was: Place} | null} the B that the last pick replaced */
    this.replaced = null;
    this.seconds = 0; // wished duration; 0 leaves it to the corpus
    /** @type {import("../asks/asked.js").Reach[]} places for hands and feet, where A stands */
    this.reaches = [];
    /** @type {any} the movement that the viewer shows to set them; null otherwise */
    this.scene = null;
    /** @type {"near" | "usual" | "far"} how far alternatives go from the best movement */
    this.spread = "usual";
    /** @type {{account: Account, motion: any, job: string}[]} with the search's job, which a cancelled search has no more */
    this.found = [];
    this.chosen = 0;
    /** @type {string | null} the search's job */
    this.job = null;
    this.state = "idle"; // "idle" | "searching" | "found" | "failed"
    this.words = "";
    this.away = false; // whether the server did not answer
    this.shown = false;
    this.since = 0; // when the search began, milliseconds
    this.asked = 0; // counts searches, to recognise late answers
    /** @type {any} the job's last known state */
    this.seen = null;
    this.taking = 0; // the search whose movements are being fetched
    this.keeper = new Keeper(this);
    studio.store.addEventListener("change", () => this.#follow());
    studio.store.addEventListener("back", () => this.away && this.search());
  }

  /** Pick a posture: the first is A, each further one B. @param {Place} place */
  pick(place) {
    this.choice = place;
    const { a, b } = this.ends;
    if (!a) this.set("a", place);
    else if (same(a, place)) this.#changed();
    else {
      this.set("b", place);
      if (b && !same(b, place)) this.replaced = { by: place, was: b };
    }
  }

  /** Set an end; the posture that a pick has just put in B moves to A, and B is what it was. @param {"a" | "b"} end @param {Place | null} place */
  set(end, place) {
    const { replaced, ends } = this;
    this.replaced = null;
    if (place && ends[end] && same(/** @type {Place} */ (ends[end]), place)) {
      this.#changed();
      return;
    }
    this.ends = { ...ends, [end]: place };
    if (end === "a") this.reaches = []; // they were where the other one stands
    if (end === "a" && place && replaced && same(replaced.by, place)) this.ends.b = replaced.was;
    this.search();
  }

  swap() {
    this.ends = { a: this.ends.b, b: this.ends.a };
    this.reaches = [];
    this.search();
  }

  /** @param {number} seconds */
  take(seconds) {
    this.seconds = seconds;
    this.search();
  }

  /** Ask for alternatives that go as far from the best movement. @param {"near" | "usual" | "far"} spread */
  go(spread) {
    this.spread = spread;
    this.search();
  }

  /** Set places to reach, and search again while the viewer stays. @param {import("../asks/asked.js").Reach[]} reaches */
  reach(reaches) {
    this.reaches = reaches;
    this.search(!this.looking);
  }

  /** Whether the viewer shows a movement from A to B to set places in. */
  get looking() {
    return this.scene !== null && this.studio.viewer.motion === this.scene;
  }

  /** Show the chosen alternative in the viewer, to set places there. */
  look() {
    const { viewer } = this.studio;
    const motion = this.found[this.chosen]?.motion;
    if (!motion || motion === this.scene) return;
    const [time, look] = this.looking ? [viewer.player.time, false] : [motion.end / 2, true];
    this.scene = motion;
    this.show(false);
    viewer.show(motion, { time, title: "From A to B", look });
  }

  /** Search for alternatives if both ends are set; cancel an earlier search. Show them in place of the viewer, or not. */
  async search(shown = true) {
    this.stop();
    const { a, b } = this.ends;
    const state = a && b ? "searching" : "idle";
    Object.assign(this, { found: [], chosen: 0, words: "", away: false, state, shown: shown && Boolean(a && b) });
    if (shown) this.scene = null;
    this.since = performance.now();
    this.#changed();
    if (!a || !b) return;
    const asked = ++this.asked;
    const options = { reaches: this.reaches, ...(this.seconds && { seconds: this.seconds }) };
    const ask = { a: bare(a), b: bare(b), options, spread: this.spread };
    try {
      const { job } = await this.studio.api.post("/api/between", ask);
      if (asked !== this.asked) {
        this.studio.api.delete(`/api/jobs/${job}`).catch(() => {});
        return;
      }
      this.job = job;
      this.#follow();
    } catch (error) {
      if (asked !== this.asked) return;
      this.away = error instanceof AwayError;
      this.#fail(error instanceof Error ? error.message : String(error));
    }
  }

  /**
   * Take back what this window had set before a reload.
   * @param {{a: Place | null, b: Place | null, seconds: number, reaches: import("../asks/asked.js").Reach[], spread: any,
   *   job: string | null, chosen: number, shown: boolean}} kept
   */
  restore({ a, b, seconds, reaches, spread, job, chosen, shown }) {
    Object.assign(this, { ends: { a, b }, seconds, reaches, spread });
    if (!job) {
      if (a && b && shown) this.search(); // its alternatives have expired
      else this.#changed();
      return;
    }
    this.asked++;
    Object.assign(this, { job, chosen, shown, state: "searching", since: performance.now() });
    this.#changed();
    this.studio.store.refetch({ id: job }); // a job that is over comes with no event
  }

  /** Cancel the search. */
  stop() {
    this.asked++;
    if (this.state === "searching" && this.job) this.studio.api.delete(`/api/jobs/${this.job}`).catch(() => {});
    this.job = null;
    if (this.state === "searching") Object.assign(this, { state: this.found.length ? "found" : "idle", shown: this.found.length > 0 && !this.looking });
    this.#changed();
  }

  /** @param {number} index */
  choose(index) {
    if (!this.found[index]) return;
    this.chosen = index;
    this.#changed();
  }

  /** @param {boolean} shown */
  show(shown) {
    this.shown = shown;
    if (shown) this.scene = null;
    this.#changed();
  }

  /** Add the chosen alternative to the time line. */
  accept() {
    return this.studio.once("accept", () => this.#accept());
  }

  async #accept() {
    const { chosen } = this;
    if (!this.found[chosen]) return;
    const { viewer, api, store } = this.studio;
    await api.accept(this.found[chosen].job, chosen + 1);
    // The next movement starts here.
    Object.assign(this, { ends: { a: this.ends.b, b: null }, choice: null, found: [], reaches: [], scene: null, state: "idle", shown: false, job: null });
    viewer.back();
    const seam = store.state.piece.seams.at(-1);
    if (seam) {
      store.set({ selection: { seam: [seam.left, seam.right] } });
      viewer.player.seek(seam.at); // the start of the accepted movement
    }
    this.#changed();
    this.dispatchEvent(new Event("accepted"));
  }

  /** Handle the job's new state. */
  async #follow() {
    const job = this.#latest;
    if (!job || job === this.seen) return;
    this.seen = job;
    this.words = job.state === "waiting" ? "Waiting for the engine." : "";
    if (job.state === "failed") {
      if (job.lost) {
        this.job = null; // the job no longer exists
        this.search(!this.looking);
      } else this.#fail(job.words);
      return;
    }
    this.#changed();
    if (this.taking === this.asked) return; // the loop under way sees this too
    const { asked } = this;
    this.taking = asked;
    await this.studio.act(() => this.#takeIn(asked));
    if (this.taking === asked) this.taking = 0;
    if (asked === this.asked && this.#latest?.state === "done") {
      this.words = this.found.length < MAX_ALTERNATIVES ? "No other movement differs enough." : "";
      this.state = "found";
      this.#changed();
    }
  }

  /** Fetch the found movements, one after another. @param {number} asked */
  async #takeIn(asked) {
    for (;;) {
      const account = this.#latest?.partial?.[this.found.length];
      if (!account) return;
      const motion = playable(await this.studio.api.get(`/api/between/${this.job}/${account.number}`));
      if (asked !== this.asked) return;
      this.found = [...this.found, { account, motion, job: /** @type {string} */ (this.job) }];
      if (this.looking && this.found.length === this.chosen + 1) this.look();
      this.#changed();
    }
  }

  /** The last known state of the search's job. */
  get #latest() {
    return this.job && this.state === "searching" ? this.studio.store.jobs.get(this.job) : undefined;
  }

  /** @param {string} words */
  #fail(words) {
    Object.assign(this, { state: "failed", words, shown: !this.looking });
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event("change"));
  }
}

/** @param {Place} one @param {Place} other */
export function same(one, other) {
  return one.key === other.key && one.frame === other.frame;
}

/** @param {Place} place */
function bare({ key, frame }) {
  return { key, frame };
}

/** The place in a drag, or null. @param {DragEvent} event @returns {Place | null} */
export function dropped(event) {
  try {
    return JSON.parse(event.dataTransfer?.getData(POSTURE_TYPE) ?? "");
  } catch {
    return null;
  }
}

/** The one desk of a studio. @param {any} studio @returns {Desk} */
export function deskOf(studio) {
  studio.desk ??= new Desk(studio);
  return studio.desk;
}
