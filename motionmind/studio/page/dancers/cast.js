/** The dancers as the page knows them: how they play together, who is hidden, who comes too near. It draws nothing. */

import { perStudio } from "../shell/hooks.js";
import { newId } from "../timeline/items.js";
import { gather } from "./troupe.js";

export const NOBODY = { dancers: [], changes: [] };
const SPACING_M = 1.5; // between neighbours
const SAME_PLACE_M = 0.5;

export const castOf = perStudio((studio) => new Cast(studio));

/**
 * @typedef {{id: string, name: string, place: [number, number], facing: number, entry: number, mirrored: boolean,
 *   source: string}} Dancer
 * @typedef {{at: number, counts: number, formation: string | null, spacing: number, places: Record<string, number[]>}} Change
 */

/** Fires "change". */
class Cast extends EventTarget {
  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    /** @type {import("./troupe.js").Data | null} how they play; null without dancers */
    this.data = null;
    /** @type {{names: string[], metres: number, seconds: number, count: number}[] | null} null until it is known */
    this.near = null;
    this.error = "";
    /** @type {Set<string>} ids of hidden dancers */
    this.hidden = new Set();
    /** @type {any} */
    this.troupe = null;
    /** @type {Promise<any>} settles when all edits so far are answered */
    this.turn = Promise.resolve();
    this.requests = 0;
    this.version = 0;
  }

  /** @returns {{dancers: Dancer[], changes: Change[]}} */
  get now() {
    return this.studio.store.state?.cast ?? NOBODY;
  }

  get tempo() {
    return this.studio.store.state?.tempo ?? 120;
  }

  /** When the last dancer comes to rest, seconds. */
  get seconds() {
    return this.data?.seconds ?? 0;
  }

  /** The piece as all dancers dance it; as it is, if there are none. @param {any} piece a Composed */
  async gather(piece) {
    if (this.now.dancers.length === 0) {
      this.clear();
      return piece;
    }
    const request = ++this.requests;
    try {
      const data = await this.studio.api.get("/api/ensemble");
      const troupe = await gather(piece, data);
      if (request === this.requests) {
        this.#set({ data, troupe, near: null, error: "" });
        this.#show();
        this.#look(request);
      }
      return troupe;
    } catch (error) {
      if (request === this.requests) this.#set({ data: null, near: [], troupe: null, error: /** @type {Error} */ (error).message });
      return piece;
    }
  }

  /** Forget how they play: nobody dances, or the piece is empty. */
  clear() {
    this.requests += 1; // what is under way sets nothing
    this.#set({ data: null, near: [], error: "", troupe: null });
  }

  /** Find who comes too near. @param {number} request */
  async #look(request) {
    if (this.studio.api.looks) return;
    const near = await this.studio.api.get("/api/ensemble/near").catch(() => []);
    if (request === this.requests) this.#set({ near });
  }

  /** Hide a dancer in the viewer, or show it again. @param {string} id */
  toggle(id) {
    if (!this.hidden.delete(id)) this.hidden.add(id);
    this.#show();
    this.#set({});
  }

  #show() {
    for (const dancer of this.troupe?.dancers ?? []) dancer.shown = !this.hidden.has(dancer.id);
    this.studio.viewer.stale();
  }

  /** @param {Partial<Cast>} fields */
  #set(fields) {
    Object.assign(this, fields);
    this.version += 1;
    this.dispatchEvent(new Event("change"));
  }

  /** Show all dancers at a time. @param {number} time */
  seek(time) {
    const { viewer } = this.studio;
    this.#home();
    viewer.player.pause();
    viewer.player.seek(time);
  }

  #home() {
    if (!this.studio.viewer.isHome) this.studio.viewer.back();
  }

  /** The count at a time of all. @param {number} time */
  countAt(time) {
    return 1 + (time * this.tempo) / 60;
  }

  /** @param {number} count */
  timeOf(count) {
    return ((count - 1) * 60) / this.tempo;
  }

  /** Send an edit, which is made after all earlier ones are answered; null does nothing. @param {() => object | null} make */
  edit(make) {
    const doing = async () => {
      await this.studio.api.changed;
      const edit = make();
      if (!edit) return;
      this.#home();
      await this.studio.api.edit(edit);
    };
    this.turn = this.turn.then(() => this.studio.act(doing));
    return this.turn;
  }

  /** Change a dancer. @param {string} id @param {(dancer: Dancer) => Partial<Dancer>} change */
  change(id, change) {
    return this.edit(() => {
      const known = this.now.dancers.find((one) => one.id === id);
      const dancer = known && { ...known, ...change(known) };
      return dancer && JSON.stringify(dancer) !== JSON.stringify(known) ? { edit: "dancer", dancer } : null;
    });
  }

  /** Replace the changes of formation. @param {(changes: Change[]) => Change[]} change */
  form(change) {
    return this.edit(() => ({ edit: "formations", changes: change(this.now.changes) }));
  }

  /** Add a dancer; the first one comes with it. @param {{canon: number, mirrored: boolean, place: [number, number], facing: number}} how */
  add({ canon, mirrored, place, facing }) {
    return this.edit(() => {
      const { window } = this.studio;
      const { dancers } = this.now;
      const all = dancers.length ? dancers : [made(window, dancers, {})];
      const last = all[all.length - 1];
      const added = made(window, all, { mirrored, place, facing, entry: last.entry + canon });
      const edits = [...(dancers.length ? [] : all), added].map((dancer) => ({ edit: "dancer", dancer }));
      return { edit: "several", edits, words: `add ${added.name}` };
    });
  }

  /** A place beside all others. @returns {[number, number]} */
  get freePlace() {
    const taken = this.now.dancers.length ? this.now.dancers.map(({ place }) => place) : [[0, 0]];
    for (let step = 1; ; step++) {
      for (const x of [step * SPACING_M, -step * SPACING_M]) {
        if (taken.every(([one, other]) => Math.hypot(one - x, other) > SAME_PLACE_M)) return [x, 0];
      }
    }
  }
}

/** A new dancer. @param {string} window this window's name @param {Dancer[]} others @param {Partial<Dancer>} fields @returns {Dancer} */
function made(window, others, fields) {
  let number = others.length + 1;
  while (others.some(({ name }) => name === `Dancer ${number}`)) number += 1;
  return { id: newId(window), name: `Dancer ${number}`, place: [0, 0], facing: 0, entry: 1, mirrored: false, source: "", ...fields };
}
