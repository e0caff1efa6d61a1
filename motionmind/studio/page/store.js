/** The page's state: the project, the selection, and the jobs. It knows no views. */

import { AwayError } from "./api.js";
import { knowPostures } from "./places.js";
import { useChange } from "./shell/hooks.js";

const RETRY_MS = [500, 1000, 2000, 4000]; // until a lost connection is tried again
const SILENCE_MS = 40_000; // without a word: the studio sends one every 15 s
const WATCH_MS = 2000;
const OVER = new Set(["done", "failed", "cancelled"]);
const LOST = "The studio restarted during this job.";
const MAX_FINISHED_JOBS = 50;

/**
 * Fires "change" on any change, "job" with a job's new state, and "back" when the connection returns; jobs that the studio
 * then does not know have failed, with `lost` set.
 */
export class Store extends EventTarget {
  /** @param {import("./api.js").Api} api */
  constructor(api) {
    super();
    this.api = api;
    /** @type {any} the answer of GET /api/project; null before it arrives */
    this.state = null;
    /** @type {{block?: string, seam?: [string, string]} | null} */
    this.selection = null;
    this.time = 0; // seconds of the piece
    /** @type {Map<string, any>} */
    this.jobs = new Map();
    this.connected = true;
    this.refusal = ""; // why the studio refuses this page after a restart
    this.stopped = false; // whether smoothing of seams is paused
    this.tries = 0;
    this.heard = 0; // the latest sequence number announced
    this.heardAt = 0; // when the server last sent anything, milliseconds
    /** @type {EventSource | null} */
    this.source = null;
    this.retrying = 0; // the timer of the next try
    api.taken = (state) => this.take(state);
  }

  /** Fetch the project once this browser is authorised, and listen to events. */
  async start() {
    await this.api.entered;
    this.#listen();
    this.#watch();
    await this.load();
    await this.api.renewal.learn();
  }

  /** Fetch the project. */
  async load() {
    const path = `/api/project?window=${this.api.window}`;
    this.take(await this.api.get(path));
    // An edit may have happened while the first answer was on its way.
    if (this.state.sequence < this.heard) this.take(await this.api.get(path));
  }

  /** Replace the state, unless the new one is older. @param {any} state */
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
    clearTimeout(this.retrying);
    const source = new EventSource(`/api/events?window=${this.api.window}`);
    this.source = source;
    for (const kind of ["open", "here", "project", "smoothing", "job"]) {
      source.addEventListener(kind, () => (this.heardAt = Date.now()));
    }
    this.heardAt = Date.now();
    source.addEventListener("open", () => {
      this.tries = 0;
      this.stopped = false; // otherwise the next event says so
      if (!this.connected) this.#return();
    });
    source.addEventListener("project", (event) => {
      const { sequence, left, notices } = JSON.parse(event.data); // `left` is a closed window: other windows may undo its edits
      this.heard = sequence;
      const noticed = notices !== undefined && notices !== this.state?.words.length;
      if (this.state && (left || noticed || sequence > this.state.sequence)) this.load().catch(() => {});
    });
    source.addEventListener("smoothing", (event) => this.set(JSON.parse(event.data)));
    source.addEventListener("job", (event) => this.#hear(JSON.parse(event.data)));
    source.addEventListener("error", () => this.#lose());
  }

  /** Handle a connection that ended, or is silent. */
  #lose() {
    this.source?.close();
    this.set({ connected: false });
    // Event streams give no reason. A restarted studio may let the page in again, or require the URL that it printed.
    this.load().then(
      () => this.set({ refusal: "" }),
      (error) => this.set({ refusal: error instanceof AwayError ? "" : error.message }),
    );
    clearTimeout(this.retrying);
    this.retrying = setTimeout(() => this.#listen(), RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)]);
  }

  /** Notice a connection that broke without a word, and a network that came back. */
  #watch() {
    setInterval(() => this.connected && Date.now() - this.heardAt > SILENCE_MS && this.#lose(), WATCH_MS);
    addEventListener("online", () => this.connected || this.#listen());
  }

  /** Handle a connection that returned, perhaps to a restarted studio. */
  #return() {
    this.load()
      .then(() => this.api.renewal.learn())
      .catch(() => {});
    this.set({ connected: true });
    for (const job of this.jobs.values()) if (!OVER.has(job.state)) this.refetch(job);
    this.dispatchEvent(new Event("back"));
  }

  /** Fetch a job's state; a job that the studio does not know has failed. @param {{id: string}} job */
  async refetch(job) {
    const lost = { ...job, state: "failed", words: LOST, lost: true };
    const found = await this.api.get(`/api/jobs/${job.id}`).catch((error) => (error instanceof AwayError ? null : lost));
    if (found) this.#hear(found);
  }

  /** @param {any} job */
  #hear(job) {
    this.jobs = new Map(this.jobs).set(job.id, job);
    for (const [id, { state }] of this.jobs) {
      if (this.jobs.size <= MAX_FINISHED_JOBS) break;
      if (OVER.has(state)) this.jobs.delete(id);
    }
    this.dispatchEvent(Object.assign(new Event("job"), { job }));
    this.dispatchEvent(new Event("change"));
  }
}

/** The job that prepares the first search, while it runs. @param {Store} store @returns {any} */
export function preparing(store) {
  return [...store.jobs.values()].find(({ kind, state }) => kind === "getting ready" && state === "running");
}

/** What searches wait for, in words; undefined once they may begin. @param {Store} store */
export function awaited(store) {
  const words = preparing(store)?.words;
  return words?.startsWith("getting ready") ? words : undefined;
}

/**
 * Return what `pick` takes from the store; render again when it changes.
 * @template T
 * @param {{store: Store}} studio
 * @param {(store: Store) => T} pick must return an identical value as long as nothing has changed
 * @returns {T}
 */
export function useStore({ store }, pick) {
  return useChange(store, () => pick(store));
}
