/** What the page knows: the project as it stands, what is selected, and the jobs that run. It knows no views. */

import { AwayError } from "./api.js";
import { knowPostures } from "./places.js";
import { useChange } from "./shell/hooks.js";

const AGAIN = [500, 1000, 2000, 4000]; // milliseconds until a lost connection is tried again
const OVER = new Set(["done", "failed", "cancelled"]);
const LOST = "The studio was started again in the middle of it.";
const REMEMBERED = 50; // jobs that are over

/**
 * Fires "change" whenever something has changed, "job" with what a job has come to, and "back" once the studio is there
 * again; jobs that it does not know then were lost: they have failed, and `lost` says so.
 */
export class Store extends EventTarget {
  /** @param {import("./api.js").Api} api */
  constructor(api) {
    super();
    this.api = api;
    /** @type {any} what GET /api/project gives; null before it is there */
    this.state = null;
    /** @type {{block?: string, seam?: [string, string]} | null} */
    this.selection = null;
    this.time = 0; // seconds of the piece
    /** @type {Map<string, any>} */
    this.jobs = new Map();
    this.connected = true;
    this.refusal = ""; // why the studio does not let this page in again, if it is there
    this.stopped = false; // whether seams wait until somebody lets smoothing go on
    this.tries = 0;
    this.heard = 0; // the latest sequence that was told of
    api.taken = (state) => this.take(state);
  }

  /** Fetch the project once this browser is let in, and listen. */
  async start() {
    await this.api.entered;
    this.#listen();
    await this.load();
  }

  /** Fetch the project as it stands. */
  async load() {
    const path = `/api/project?window=${this.api.window}`;
    this.take(await this.api.get(path));
    // The first answer may have been on its way when something was edited.
    if (this.state.sequence < this.heard) this.take(await this.api.get(path));
  }

  /** Take over a state, unless it is older than the one that is there. @param {any} state */
  take(state) {
    if (this.state && state.sequence < this.state.sequence) return;
    knowPostures(state.postures);
    this.set({ state });
  }

  /** Set some of the fields. @param {object} fields */
  set(fields) {
    Object.assign(this, fields);
    this.dispatchEvent(new Event("change"));
  }

  #listen() {
    const source = new EventSource(`/api/events?window=${this.api.window}`);
    source.addEventListener("open", () => {
      this.tries = 0;
      this.stopped = false; // or else the next event says so
      if (!this.connected) this.#return();
    });
    source.addEventListener("project", (event) => {
      const { sequence, left } = JSON.parse(event.data); // `left` is a window whose edits are everybody's now
      this.heard = sequence;
      if (this.state && (left || sequence > this.state.sequence)) this.load().catch(() => {});
    });
    source.addEventListener("smoothing", (event) => this.set(JSON.parse(event.data)));
    source.addEventListener("job", (event) => this.#hear(JSON.parse(event.data)));
    source.addEventListener("error", () => {
      source.close();
      this.set({ connected: false });
      // Streams do not tell why: a studio that was started again lets in who has the address that it printed then.
      this.load().catch((error) => this.set({ refusal: error instanceof AwayError ? "" : error.message }));
      setTimeout(() => this.#listen(), AGAIN[Math.min(this.tries++, AGAIN.length - 1)]);
    });
  }

  /** The studio is there again, or another that was started in its place. */
  #return() {
    this.load().catch(() => {});
    this.set({ connected: true });
    for (const job of this.jobs.values()) if (!OVER.has(job.state)) this.#lookFor(job);
    this.dispatchEvent(new Event("back"));
  }

  /** @param {any} job */
  async #lookFor(job) {
    const lost = { ...job, state: "failed", words: LOST, lost: true };
    const found = await this.api.get(`/api/jobs/${job.id}`).catch((error) => (error instanceof AwayError ? null : lost));
    if (found) this.#hear(found);
  }

  /** @param {any} job */
  #hear(job) {
    this.jobs = new Map(this.jobs).set(job.id, job);
    for (const [id, { state }] of this.jobs) {
      if (this.jobs.size <= REMEMBERED) break;
      if (OVER.has(state)) this.jobs.delete(id);
    }
    this.dispatchEvent(Object.assign(new Event("job"), { job }));
    this.dispatchEvent(new Event("change"));
  }
}

/** The job that makes searches fast the first time, while it runs. @param {Store} store @returns {any} */
export function preparing(store) {
  return [...store.jobs.values()].find(({ kind, state }) => kind === "getting ready" && state === "running");
}

/** What searches wait for, in words; none once the rest is got ready beside them. @param {Store} store */
export function awaited(store) {
  const words = preparing(store)?.words;
  return words?.startsWith("getting ready") ? words : undefined;
}

/**
 * What `pick` takes from the store; the view is made again when that changes.
 * @template T
 * @param {{store: Store}} studio
 * @param {(store: Store) => T} pick returns something that is the same as long as nothing has changed
 * @returns {T}
 */
export function useStore({ store }, pick) {
  return useChange(store, () => pick(store));
}
