/** Requests to the studio's server. A failure throws an Error with a one-line message for the user. */

const AWAY = "The studio does not answer. Is it still running?";

/** The server does not answer. */
export class AwayError extends Error {}

/** The piece has changed since the request was prepared. */
export class StaleError extends Error {}

export class Api extends EventTarget {
  constructor() {
    super();
    /** This window's name, which survives a reload: only this window undoes its edits. */
    this.window = sessionStorage.getItem("motionmind-window") ?? `w${crypto.randomUUID().slice(0, 12)}`;
    sessionStorage.setItem("motionmind-window", this.window);
    /** @type {(state: any) => void} called with the answer to every edit */
    this.taken = () => {};
    /** @type {Promise<any>} settles with the last change: the next one waits, because requests may overtake each other */
    this.changed = Promise.resolve();
    /** @type {Map<string, Promise<any>>} prefetched answers by path */
    this.prefetched = new Map();
    /** @type {Promise<any>} settles when this browser is authorised */
    this.entered = this.#enter();
    this.entered.catch(() => {}); // requests that wait for it report the error
  }

  /** Exchange the token in the URL, if there is one, for the cookie. */
  async #enter() {
    const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? location.hash.slice(1);
    if (!token) return;
    history.replaceState(null, "", location.pathname + location.search);
    await this.post("/api/enter", { token });
  }

  /** Fetch a path now for one later `get`. @param {string} path @returns {Promise<any>} */
  prefetch(path) {
    const answer = this.entered.then(() => this.#ask(path, { method: "GET" }));
    answer.catch(() => {});
    this.prefetched.set(path, answer);
    return answer;
  }

  /** @param {string} path @returns {Promise<any>} */
  get(path) {
    const answer = this.prefetched.get(path);
    this.prefetched.delete(path);
    return answer ?? this.#ask(path, { method: "GET" });
  }

  /** @param {string} path @param {object} body @returns {Promise<any>} */
  post(path, body = {}) {
    return this.#ask(path, { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } });
  }

  /** @param {string} path @returns {Promise<any>} */
  delete(path) {
    return this.#ask(path, { method: "DELETE" });
  }

  /** Send a file as it is. @param {string} path @param {Blob} file @param {string} name @returns {Promise<any>} */
  upload(path, file, name) {
    return this.#ask(path, { method: "POST", body: file, headers: { "X-Name": encodeURIComponent(name) } });
  }

  /** Fetch a file that the server makes. @param {string} path @returns {Promise<Response>} */
  file(path) {
    return this.#answer(path, { method: "GET" });
  }

  /** Edit the project; return the new state, which the store has taken. @param {object} edit */
  edit(edit) {
    return this.#change("/api/edits", { edit });
  }

  /** Add an alternative that a search found to the time line. @param {string} job @param {number} alternative from 1 */
  accept(job, alternative) {
    return this.#change("/api/between/accept", { job, alternative });
  }

  /** Make a proposed variation the piece. @param {object} edit @param {string} basis of the proposal */
  arrange(edit, basis) {
    return this.#change("/api/vary/accept", { edit, basis });
  }

  undo() {
    return this.#change("/api/undo");
  }

  redo() {
    return this.#change("/api/redo");
  }

  /** @param {string} path @param {object} body @returns {Promise<any>} */
  #change(path, body = {}) {
    const change = async () => {
      const state = await this.post(path, { window: this.window, ...body });
      this.taken(state);
      return state;
    };
    const changed = this.changed.then(change);
    this.changed = changed.catch(() => {}); // the caller gets the error
    return changed;
  }

  /** @param {string} path @param {RequestInit} request */
  async #ask(path, request) {
    return (await this.#answer(path, request)).json().catch(() => ({}));
  }

  /** @param {string} path @param {RequestInit} request */
  async #answer(path, request) {
    if (request.method !== "GET") this.prefetched.clear(); // prefetched answers may be out of date
    const headers = { "X-MotionMind": "studio", ...request.headers };
    const answer = await fetch(path, { ...request, headers, credentials: "same-origin" }).catch(() => {
      throw new AwayError(AWAY);
    });
    if (answer.ok) return answer;
    const { error } = await answer.json().catch(() => ({}));
    const Kind = answer.status === 412 ? StaleError : Error;
    throw new Kind(error ?? `The studio answered with ${answer.status}.`);
  }
}
