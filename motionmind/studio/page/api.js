/** Requests to the studio's server. What fails throws an Error whose message is one line for people. */

const AWAY = "The studio does not answer: has it ended?";

const ANOTHER = 412; // the status of what was asked for a piece that is another now

/** The request could not be made, for nobody answers. */
export class AwayError extends Error {}

/** What was asked for is of a piece that has become another meanwhile. */
export class AnotherError extends Error {}

export class Api extends EventTarget {
  constructor() {
    super();
    /** This window's name: what it did, it alone takes back; a reload keeps it. */
    this.window = sessionStorage.getItem("motionmind-window") ?? `w${crypto.randomUUID().slice(0, 12)}`;
    sessionStorage.setItem("motionmind-window", this.window);
    /** @type {(state: any) => void} called with what every edit answers */
    this.taken = () => {};
    /** @type {Promise<any>} over with the last change that was asked for: the next waits, for requests overtake others */
    this.changed = Promise.resolve();
    /** @type {Map<string, Promise<any>>} answers that were asked for before anybody needs them, by their path */
    this.expected = new Map();
    /** @type {Promise<any>} over when this browser is let in */
    this.entered = this.#enter();
    this.entered.catch(() => {}); // who waits for it hears why
  }

  /** Exchange the token in the address, if there is one, for the cookie that lets this browser in. */
  async #enter() {
    const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? location.hash.slice(1);
    if (!token) return;
    history.replaceState(null, "", location.pathname + location.search);
    await this.post("/api/enter", { token });
  }

  /** Ask now for what will be needed soon, once. @param {string} path @returns {Promise<any>} */
  expect(path) {
    const answer = this.entered.then(() => this.#ask(path, { method: "GET" }));
    answer.catch(() => {});
    this.expected.set(path, answer);
    return answer;
  }

  /** @param {string} path @returns {Promise<any>} */
  get(path) {
    const answer = this.expected.get(path);
    this.expected.delete(path);
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

  /** A file that the server makes: its answer. @param {string} path @returns {Promise<Response>} */
  file(path) {
    return this.#answer(path, { method: "GET" });
  }

  /** Edit the project: the new state, which the store has taken over. @param {object} edit */
  edit(edit) {
    return this.#change("/api/edits", { edit });
  }

  /** Put an alternative that a search found onto the line of time. @param {string} job @param {number} alternative from 1 */
  accept(job, alternative) {
    return this.#change("/api/between/accept", { job, alternative });
  }

  /** Make the order of a variation the piece that it was proposed for. @param {object} edit @param {string} basis of the proposal */
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
    this.changed = changed.catch(() => {}); // who asked hears of what failed
    return changed;
  }

  /** @param {string} path @param {RequestInit} request */
  async #ask(path, request) {
    return (await this.#answer(path, request)).json().catch(() => ({}));
  }

  /** @param {string} path @param {RequestInit} request */
  async #answer(path, request) {
    if (request.method !== "GET") this.expected.clear(); // what was answered before may be so no more
    const headers = { "X-MotionMind": "studio", ...request.headers };
    const answer = await fetch(path, { ...request, headers, credentials: "same-origin" }).catch(() => {
      throw new AwayError(AWAY);
    });
    if (answer.ok) return answer;
    const { error } = await answer.json().catch(() => ({}));
    const Kind = answer.status === ANOTHER ? AnotherError : Error;
    throw new Kind(error ?? `The studio answered with ${answer.status}.`);
  }
}
