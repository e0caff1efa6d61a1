/** From A to B: which two postures, what was found between them, and which of it is chosen. It knows no views. */

import { AwayError } from "../api.js";
import { playable } from "../movements.js";

const MOST = 4; // alternatives
export const DRAGGED = "application/x-motionmind-posture";

/**
 * @typedef {{key: string, frame: number, title: string}} Place
 * @typedef {{begins: number, ends: number, how: string, where: string, key: string, at: number, degrees: number}} Stretch
 * @typedef {{number: number, seconds: number, words: string, differs: string, sure: string, usual: string,
 *   beyond: string[], joints: Record<string, Stretch[]>}} Account
 */

export class Desk extends EventTarget {
  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    /** @type {{a: Place | null, b: Place | null}} */
    this.ends = { a: null, b: null };
    /** @type {Place | null} what was picked in the gallery last */
    this.choice = null;
    this.seconds = 0; // that the movement is to take; 0 leaves it to the corpus
    /** @type {{account: Account, motion: any}[]} */
    this.found = [];
    this.chosen = 0;
    /** @type {string | null} the job that searches, or searched */
    this.job = null;
    this.state = "idle"; // "idle" | "searching" | "found" | "failed"
    this.words = "";
    this.away = false; // whether nobody was there to search
    this.shown = false;
    this.asked = 0; // counts searches, so that what comes late is known
    /** @type {any} what was heard of the job last */
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

  /** Find alternatives, if both ends are there; what was being sought before is given up. */
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

  /** Give up what is being sought. */
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

  /** Put the chosen alternative onto the line of time. */
  accept() {
    return this.studio.once("accept", () => this.#accept());
  }

  async #accept() {
    const { job, chosen } = this;
    if (!this.found[chosen]) return;
    const { viewer, api, store } = this.studio;
    await api.accept(/** @type {string} */ (job), chosen + 1);
    // The next movement goes on from here.
    Object.assign(this, { ends: { a: this.ends.b, b: null }, choice: null, found: [], state: "idle", shown: false, job: null });
    viewer.back();
    const seam = store.state.piece.seams.at(-1);
    if (seam) {
      store.set({ selection: { seam: [seam.left, seam.right] } });
      viewer.player.seek(seam.at); // where what was accepted begins
    }
    this.#changed();
    this.dispatchEvent(new Event("accepted"));
  }

  /** What the job has come to. */
  async #follow() {
    const job = this.#latest;
    if (!job || job === this.seen) return;
    this.seen = job;
    this.words = job.state === "waiting" ? "It waits until the engine is free." : "";
    if (job.state === "failed") {
      if (job.lost) {
        this.job = null; // nobody is left to give it up
        this.search();
      } else this.#fail(job.words);
      return;
    }
    this.#changed();
    if (this.taking === this.asked) return; // whoever takes in movements sees this, too
    const { asked } = this;
    this.taking = asked;
    await this.studio.act(() => this.#takeIn(asked));
    if (this.taking === asked) this.taking = 0;
    if (asked === this.asked && this.#latest?.state === "done") {
      this.words = this.found.length < MOST ? "Nothing else differs enough." : "";
      this.state = "found";
      this.#changed();
    }
  }

  /** Fetch the movements that are found, one after another. @param {number} asked */
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

  /** The job that searches, as it was told of last. */
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

/** The place that is being dragged onto something, or null. @param {DragEvent} event @returns {Place | null} */
export function dropped(event) {
  try {
    return JSON.parse(event.dataTransfer?.getData(DRAGGED) ?? "");
  } catch {
    return null;
  }
}

/** The one desk of a studio. @param {any} studio @returns {Desk} */
export function deskOf(studio) {
  studio.desk ??= new Desk(studio);
  return studio.desk;
}
