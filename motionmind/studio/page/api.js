/** Requests to the studio's server. A failure throws an Error with a one-line message for the user. */

import { random, Renewal } from "./renewal.js";

const AWAY = "The studio does not answer. Is it still running?";
const ENDED = "This link is no longer valid: ask for a new one.";
const LOOKS = "motionmind-looks"; // key in this tab's storage: it was opened by the look-only link

/** The server does not answer. */
export class AwayError extends Error {}

/** The studio refuses this page, which needs the address that the terminal shows. */
export class ClosedError extends Error {}

/** The piece has changed since the request was prepared. */
export class StaleError extends Error {}

export class Api extends EventTarget {
  constructor() {
    super();
    /** This window's name, which survives a reload: only this window undoes its edits. */
    const known = sessionStorage.getItem("motionmind-window");
    this.window = known ?? `w${random(6)}`;
    this.reloaded = known !== null;
    sessionStorage.setItem("motionmind-window", this.window);
    const given = new URLSearchParams(location.hash.slice(1));
    if (given.has("look")) sessionStorage.setItem(LOOKS, "yes");
    else if (location.hash) sessionStorage.removeItem(LOOKS);
    /** Whether this page only looks, as the owner's may, too, by the look-only link. */
    this.looks = sessionStorage.getItem(LOOKS) !== null;
    /** @type {(state: any) => void} called with the answer to every edit */
    this.taken = () => {};
    /** @type {Promise<any>} settles with the last change: the next one waits, because requests may overtake each other */
    this.changed = Promise.resolve();
    this.renewal = new Renewal(this);
    /** @type {Set<string>} messages of requests that failed because there is no connection */
    this.faults = new Set();
    /** @type {Map<string, Promise<any>>} prefetched answers by path */
    this.prefetched = new Map();
    /** @type {Promise<any>} settles when this browser is authorised */
    this.entered = this.#enter(given);
    this.entered.catch(() => {}); // requests that wait for it report the error
  }

  /** Exchange the token in the URL, if there is one, for the cookie. @param {URLSearchParams} given in the URL */
  async #enter(given) {
    const token = given.get("look") ?? given.get("token") ?? location.hash.slice(1);
    if (!token) return;
    history.replaceState(null, "", location.pathname + location.search);
    await this.post("/api/enter", { token });
  }

  /** Show this page as one that only looks: it has no other key. */
  onlyLook() {
    sessionStorage.setItem(LOOKS, "yes");
    location.reload();
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

  /** @param {string} path @param {object} body @param {RequestInit} more @returns {Promise<any>} */
  post(path, body = {}, more = {}) {
    return this.#ask(path, { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" }, ...more });
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

  /** @param {string} path @param {RequestInit} request @returns {Promise<Response>} */
  async #answer(path, request, isAgain = false) {
    if (request.method !== "GET") this.prefetched.clear(); // prefetched answers may be out of date
    const headers = { "X-MotionMind": "studio", ...request.headers };
    const answer = await fetch(path, { ...request, headers, credentials: "same-origin" }).catch(() => {
      this.faults.add(AWAY);
      throw new AwayError(AWAY);
    });
    if (answer.ok) return answer;
    // The studio may have been restarted.
    if (answer.status === 401 && !isAgain && (await this.renewal.renew())) return this.#answer(path, request, true);
    const { error } = await answer.json().catch(() => ({}));
    const Kind = { 401: ClosedError, 412: StaleError }[answer.status] ?? Error;
    const hasEnded = this.looks && (answer.status === 401 || path === "/api/enter");
    const words = hasEnded ? ENDED : (error ?? `The studio answered with ${answer.status}.`);
    if (Kind === ClosedError) this.faults.add(words);
    throw new Kind(words);
  }
}
