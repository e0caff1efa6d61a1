/** From A to B: both postures, the alternatives found, and the chosen one. It knows no views. */

import { AwayError } from "../api.js";
import { playable } from "../movements.js";

export const MAX_ALTERNATIVES = 4;
export const POSTURE_TYPE = "application/x-motionmind-posture"; // of data in a drag

/**
 * @typedef {{key: string, frame: number, last?: number, title: string}} Place
 * @typedef {{begins: number, ends: number, how: string, where: string, key: string, at: number, degrees: number}} Stretch
 * @typedef {{number: number, seconds: number, words: string, differs: string, sure: string, usual: string,
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
    this.seconds = 0; // wished duration; 0 leaves it to the corpus
    /** @type {{account: Account, motion: any}[]} */
    this.found = [];
    this.chosen = 0;
    /** @type {string | null} the search's job */
    this.job = null;
    this.state = "idle"; // "idle" | "searching" | "found" | "failed"
    this.words = "";
    this.away = false; // whether the server did not answer
    this.shown = false;
    this.asked = 0; // counts searches, to recognise late answers
    /** @type {any} the job's last known state */
    this.seen = null;
    this.taking = 0; // the search whose movements are being fetched
    studio.store.addEventListener("change", () => this.#follow());
    studio.store.addEventListener("back", () => this.away && this.search());
  }

  /** Pick a posture: the first is A, the second B; later ones wait to be set. @param {Place} place */
  pick(place) {
    this.choice = place;
    if (!this.ends.a) this.set("a", place);
    else if (!this.ends.b && !same(this.ends.a, place)) this.set("b", place);
    else this.#changed();
  }

  /** @param {"a" | "b"} end @param {Place | null} place */
  set(end, place) {
    if (place && this.ends[end] && same(/** @type {Place} */ (this.ends[end]), place)) {
      this.#changed();
      return;
    }
    this.ends = { ...this.ends, [end]: place };
    this.search();
  }

  swap() {
    this.ends = { a: this.ends.b, b: this.ends.a };
    this.search();
  }

  /** @param {number} seconds */
  take(seconds) {
    this.seconds = seconds;
    this.search();
  }

  /** Search for alternatives if both ends are set; cancel an earlier search. */
  async search() {
    this.stop();
    const { a, b } = this.ends;
    Object.assign(this, { found: [], chosen: 0, words: "", away: false, state: a && b ? "searching" : "idle", shown: Boolean(a && b) });
    this.#changed();
    if (!a || !b) return;
    const asked = ++this.asked;
    const ask = { a: bare(a), b: bare(b), options: this.seconds ? { seconds: this.seconds } : {} };
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

  /** Cancel the search. */
  stop() {
    this.asked++;
    if (this.state === "searching" && this.job) this.studio.api.delete(`/api/jobs/${this.job}`).catch(() => {});
    this.job = null;
    if (this.state === "searching") Object.assign(this, { state: this.found.length ? "found" : "idle", shown: this.found.length > 0 });
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
    this.#changed();
  }

  /** Add the chosen alternative to the time line. */
  accept() {
    return this.studio.once("accept", () => this.#accept());
  }

  async #accept() {
    const { job, chosen } = this;
    if (!this.found[chosen]) return;
    const { viewer, api, store } = this.studio;
    await api.accept(/** @type {string} */ (job), chosen + 1);
    // The next movement starts here.
    Object.assign(this, { ends: { a: this.ends.b, b: null }, choice: null, found: [], state: "idle", shown: false, job: null });
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
        this.search();
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
      this.found = [...this.found, { account, motion }];
      this.#changed();
    }
  }

  /** The last known state of the search's job. */
  get #latest() {
    return this.job && this.state === "searching" ? this.studio.store.jobs.get(this.job) : undefined;
  }

  /** @param {string} words */
  #fail(words) {
    Object.assign(this, { state: "failed", words, shown: true });
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
