/** The pose editor: the posture that is being made, the steps that led to it, and what the corpus knows of it. */

import { movement } from "../movements.js";
import { Latest } from "./latest.js";
import { Posed } from "./posed.js";

const ROOM = 1.25; // how much farther away than the whole body needs: limbs go further
const STEPS = 200; // that can be taken back

/**
 * @typedef {{rotations: number[], root: number[]}} Posture
 * @typedef {{joint: string, words: string}} Joint
 * @typedef {{joint: string, words: string, on: string, at: [number, number, number]}} Handle a joint, or a heel on one
 * @typedef {{joint: string, words: string, angle: string, label: string, least: number, most: number, degrees: number}} Turn
 * @typedef {"seen" | "near" | "unseen"} Known
 * @typedef {{motion: any, key: string, title: string, joints: Joint[], handles: Handle[], turns: Turn[], mirrors: boolean,
 *   released: Set<string>}} Opened what is posed: the movement that the posture was opened of, and its body
 * @typedef {{posture: Posture, opened: Opened, words: string}} Step
 */

/** @type {WeakMap<object, Editor>} */
const editors = new WeakMap();

/** The editor of a page. @param {any} studio @returns {Editor} */
export function editorOf(studio) {
  const known = editors.get(studio) ?? new Editor(studio);
  editors.set(studio, known);
  return known;
}

/** Fires "change" whenever something has changed, and "open" when another posture was opened. */
export class Editor extends EventTarget {
  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    /** @type {any} the posture as the viewer shows it */
    this.motion = null;
    this.key = "";
    this.title = "";
    this.corpus = "";
    /** @type {Joint[]} */
    this.joints = [];
    /** @type {Handle[]} */
    this.handles = [];
    /** @type {Turn[]} */
    this.turns = [];
    /** @type {Known[]} how well each joint is known; empty where the corpus is of another body */
    this.known = [];
    /** @type {string[]} the feet that stand, by their last joints */
    this.standing = [];
    /** @type {Set<string>} feet that may leave their places */
    this.released = new Set();
    this.mirrors = false;
    this.selected = "";
    this.dragged = ""; // the joint or heel that was dragged last
    this.words = "";
    /** @type {Posture} */
    this.posture = { rotations: [], root: [] };
    /** @type {Step[]} */
    this.past = [];
    /** @type {Step[]} */
    this.future = [];
    /** @type {{posture: Posture, standing: string[], words: string} | null} where a drag or a turn began, and what it is */
    this.began = null;
    this.version = 0; // counts changes, for views
    this.requests = new Latest(
      (told) => this.#take(told),
      (error) => studio.say(error instanceof Error ? error.message : String(error), { kind: "error" }),
      () => this.#changed(),
    );
  }

  /**
   * Open a frame of a movement. If a posture is being made, that is a step of it, which can be taken back.
   * @param {string} key @param {number} frame @param {string} name the movement's title if ""
   */
  async open(key, frame = 0, name = "") {
    const [told, source] = await Promise.all([
      this.studio.api.post("/api/pose/open", { key, frame }),
      movement(this.studio.api, key),
    ]);
    await this.end();
    const { joints, handles, mirrors } = told;
    const title = name || told.title;
    const shown = told.rotations.length ? { rotations: told.rotations, root: told.root } : this.posture;
    if (this.past.length) this.#step(this.posture, `start from ${title}`);
    else this.future = [];
    this.#put({ motion: new Posed(source, shown), key, title, joints, handles, turns: [], mirrors, released: new Set() });
    this.#take(told);
    this.show();
    this.dispatchEvent(new Event("open"));
  }

  /** Have the viewer show it. */
  show() {
    if (!this.motion) return;
    const { viewer } = this.studio;
    viewer.show(this.motion, { time: 0, title: `${this.title}, being changed` });
    if (!viewer.stage) return;
    const { camera, controls } = viewer.stage;
    viewer.stage.view = undefined; // else it would come back where that is when the picture's size changes
    camera.position.sub(controls.target).multiplyScalar(ROOM).add(controls.target);
    controls.update();
  }

  /** Have the viewer show the piece again, if there is one. */
  leave() {
    const { viewer } = this.studio;
    if (!this.shown) return;
    if (viewer.piece) viewer.back();
    else viewer.show(this.motion, { time: 0, title: this.title, look: false });
  }

  /** Whether it is being changed. */
  get busy() {
    return this.began !== null || this.requests.busy;
  }

  /** Whether the viewer shows it. */
  get shown() {
    return this.motion !== null && this.studio.viewer.motion === this.motion;
  }

  /** The place of a handle, metres. @param {Handle} handle @returns {number[]} */
  place({ on, at }) {
    const { body, joints } = this.motion;
    body.pose(this.posture.rotations, this.posture.root);
    return body.place(joints.indexOf(on), at);
  }

  /** @param {string} joint */
  select(joint) {
    if (joint === this.selected) return;
    this.selected = joint;
    this.#changed();
  }

  /** Let a foot leave its place, or hold it there. @param {string} foot @param {boolean} stays */
  hold(foot, stays) {
    this.released = new Set(this.released);
    if (stays) this.released.delete(foot);
    else this.released.add(foot);
    this.#changed();
  }

  /** Drag a joint or a heel to a place, until `end`. @param {string} joint @param {number[]} place @param {string} words */
  drag(joint, place, words) {
    this.#begin(`drag the ${words}`);
    this.dragged = joint;
    const { began } = this;
    if (!began) return;
    const standing = began.standing.filter((foot) => !this.released.has(foot));
    this.requests.send(() =>
      this.studio.api.post("/api/pose/drag", {
        pose: this.#pose(this.posture),
        start: this.#pose(began.posture),
        joint,
        place: [place[0], Math.max(place[1], 0), place[2]],
        standing,
      }),
    );
  }

  /** Set an angle of a joint, until `end`. @param {Turn} turn @param {number} degrees */
  turn({ joint, angle, words }, degrees) {
    this.#begin(`turn the ${words}`);
    this.requests.send(() => this.studio.api.post("/api/pose/turn", { pose: this.#pose(this.posture), joint, angle, degrees }));
  }

  /** What was dragged or turned until now is one step. */
  async end() {
    await this.requests.settled();
    const { began } = this;
    this.began = null;
    if (began && differ(began.posture, this.posture)) this.#step(began.posture, began.words);
    else this.#changed();
  }

  /** Make another posture of it. @param {"mirror" | "floor" | "known" | "whole"} to @param {string} words */
  async change(to, words) {
    await this.end();
    if (!this.shown) this.show();
    const before = this.posture;
    const kept = to === "known" && this.dragged ? this.dragged : null;
    this.requests.send(() => this.studio.api.post("/api/pose/change", { pose: this.#pose(this.posture), to, kept }));
    await this.requests.settled();
    if (differ(before, this.posture)) this.#step(before, words);
  }

  async undo() {
    await this.end();
    if (!this.shown) this.show();
    this.#travel(this.past, this.future);
  }

  async redo() {
    await this.end();
    if (!this.shown) this.show();
    this.#travel(this.future, this.past);
  }

  /** Keep it in the project: its key. @param {string} name @returns {Promise<string>} */
  async keep(name) {
    await this.end();
    return (await this.studio.api.post("/api/pose/keep", { pose: this.#pose(this.posture), name })).key;
  }

  /** It as lines of a score. @param {string} name @returns {Promise<string>} */
  async lines(name) {
    return (await this.studio.api.post("/api/pose/score", { pose: this.#pose(this.posture), name })).lines;
  }

  /** @param {string} words */
  #begin(words) {
    if (this.began) return;
    this.began = { posture: this.posture, standing: this.standing, words };
    this.#changed();
  }

  /** @param {Posture} before @param {string} words */
  #step(before, words) {
    this.past = [...this.past, { posture: before, opened: this.#opened, words }].slice(-STEPS);
    this.future = [];
    this.#changed();
  }

  /** @returns {Opened} */
  get #opened() {
    const { motion, key, title, joints, handles, turns, mirrors, released } = this;
    return { motion, key, title, joints, handles, turns, mirrors, released };
  }

  /** Pose another. @param {Opened} opened */
  #put(opened) {
    Object.assign(this, opened, { selected: opened.handles[0]?.on ?? "", dragged: "", words: "" });
  }

  /** @param {Step[]} from @param {Step[]} to */
  #travel(from, to) {
    const step = from.pop();
    if (!step || !this.motion) return;
    to.push({ posture: this.posture, opened: this.#opened, words: step.words });
    const isAnother = step.opened.motion !== this.motion;
    this.posture = step.posture;
    this.dragged = "";
    if (isAnother) {
      this.#put(step.opened);
      this.motion.take(this.posture);
      this.show();
      this.dispatchEvent(new Event("open"));
    }
    this.requests.send(() => this.studio.api.post("/api/pose/tell", { pose: this.#pose(this.posture) }));
    this.#changed();
  }

  /** @param {any} told */
  #take(told) {
    this.posture = { rotations: told.rotations, root: told.root };
    this.motion.take(this.posture);
    Object.assign(this, { known: told.known, corpus: told.corpus, standing: told.standing, words: told.words ?? "" });
    this.turns = told.turns ?? this.turns.map((turn, i) => ({ ...turn, degrees: told.degrees[i] }));
    this.#changed();
  }

  /** @param {Posture} posture */
  #pose(posture) {
    return { key: this.key, ...posture };
  }

  #changed() {
    this.version++;
    this.studio.viewer.stale();
    this.dispatchEvent(new Event("change"));
  }
}

/** Whether one can see that postures differ. @param {Posture} a @param {Posture} b */
function differ(a, b) {
  const far = (/** @type {number[]} */ one, /** @type {number[]} */ other) => one.some((x, i) => Math.abs(x - other[i]) > 1e-5);
  return far(a.rotations, b.rotations) || far(a.root, b.root);
}
