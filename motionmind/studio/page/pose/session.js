/** The pose editor: the posture, the steps that led to it, and how well the corpus knows it. */

import { movement } from "../movements.js";
import { perStudio } from "../shell/hooks.js";
import { Latest } from "./latest.js";
import { Posed } from "./posed.js";

const CAMERA_DISTANCE_RATIO = 1.25; // leaves room for limbs that reach out
const MAX_UNDO_STEPS = 200;

/**
 * @typedef {{rotations: number[], root: number[]}} Posture
 * @typedef {{joint: string, words: string}} Joint
 * @typedef {{joint: string, words: string, on: string, at: [number, number, number]}} Handle a joint, or a heel on one
 * @typedef {{joint: string, words: string, angle: string, label: string, least: number, most: number, degrees: number}} Turn
 * @typedef {"seen" | "near" | "unseen"} Known
 * @typedef {{motion: any, key: string, title: string, joints: Joint[], handles: Handle[], turns: Turn[], mirrors: boolean,
 *   released: Set<string>}} Opened the movement that the posture comes from, and its body
 * @typedef {{posture: Posture, opened: Opened, words: string}} Step
 */

/** The pose editor of a studio. */
export const editorOf = perStudio((studio) => new Editor(studio));

/** Fires "change" on any change, and "open" when another posture is opened. */
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
    /** @type {Known[]} how well the corpus knows each joint; empty if it has another body */
    this.known = [];
    /** @type {string[]} the standing feet, by their last joints */
    this.standing = [];
    /** @type {Set<string>} standing feet that may leave their places */
    this.released = new Set();
    this.mirrors = false;
    /** @type {import("./balance.js").Balance | null} null if the body's masses are not known */
    this.balance = null;
    this.selected = "";
    this.dragged = ""; // the joint or heel dragged last
    this.words = "";
    /** @type {Posture} */
    this.posture = { rotations: [], root: [] };
    /** @type {Step[]} */
    this.past = [];
    /** @type {Step[]} */
    this.future = [];
    /** @type {{posture: Posture, standing: string[], words: string} | null} the drag or turn under way: where it began, and its description */
    this.began = null;
    this.version = 0; // counts changes, for views
    this.requests = new Latest(
      (answer) => this.#take(answer),
      (error) => studio.say(error instanceof Error ? error.message : String(error), { kind: "error" }),
      () => this.#changed(),
    );
  }

  /**
   * Open a frame of a movement. After earlier steps this is a step too, which undo takes back.
   * @param {string} key @param {number} frame @param {string} name the movement's title if ""
   */
  async open(key, frame = 0, name = "") {
    const [answer, source] = await Promise.all([
      this.studio.api.post("/api/pose/open", { key, frame }),
      movement(this.studio.api, key),
    ]);
    await this.end();
    const { joints, handles, mirrors } = answer;
    const title = name || answer.title;
    const shown = answer.rotations.length ? { rotations: answer.rotations, root: answer.root } : this.posture;
    if (this.past.length) this.#step(this.posture, `start from ${title}`);
    else this.future = [];
    this.#put({ motion: new Posed(source, shown), key, title, joints, handles, turns: [], mirrors, released: new Set() });
    this.#take(answer);
    this.show();
    this.dispatchEvent(new Event("open"));
  }

  /** Show the posture in the viewer. */
  show() {
    if (!this.motion) return;
    const { viewer } = this.studio;
    viewer.show(this.motion, { time: 0, title: `${this.title}, being edited` });
    if (!viewer.stage) return;
    const { camera, controls } = viewer.stage;
    viewer.stage.view = undefined; // otherwise a resize would reset the camera
    camera.position.sub(controls.target).multiplyScalar(CAMERA_DISTANCE_RATIO).add(controls.target);
    controls.update();
  }

  /** Show the piece again, if there is one. */
  leave() {
    const { viewer } = this.studio;
    if (!this.shown) return;
    if (viewer.piece) viewer.back();
    else viewer.show(this.motion, { time: 0, title: this.title, look: false });
  }

  /** Whether a change is under way. */
  get busy() {
    return this.began !== null || this.requests.busy;
  }

  /** Whether the viewer shows the posture. */
  get shown() {
    return this.motion !== null && this.studio.viewer.motion === this.motion;
  }

  /** The position of a handle, metres. @param {Handle} handle @returns {number[]} */
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

  /** Hold a foot in its place, or release it. @param {string} foot @param {boolean} stays */
  hold(foot, stays) {
    this.released = new Set(this.released);
    if (stays) this.released.delete(foot);
    else this.released.add(foot);
    this.#changed();
  }

  /** Drag a joint or a heel to a position, until `end`. @param {string} joint @param {number[]} place @param {string} words */
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

  /** End a drag or a turn, which becomes one step. */
  async end() {
    await this.requests.settled();
    const { began } = this;
    this.began = null;
    if (began && differ(began.posture, this.posture)) this.#step(began.posture, began.words);
    else this.#changed();
  }

  /** Change the whole posture. @param {"mirror" | "floor" | "known" | "whole"} to @param {string} words */
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

  /** Store the posture in the project; return its key. @param {string} name @returns {Promise<string>} */
  async keep(name) {
    await this.end();
    return (await this.studio.api.post("/api/pose/keep", { pose: this.#pose(this.posture), name })).key;
  }

  /** Return the posture as lines of a score. @param {string} name @returns {Promise<string>} */
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
    this.past = [...this.past, { posture: before, opened: this.#opened, words }].slice(-MAX_UNDO_STEPS);
    this.future = [];
    this.#changed();
  }

  /** @returns {Opened} */
  get #opened() {
    const { motion, key, title, joints, handles, turns, mirrors, released } = this;
    return { motion, key, title, joints, handles, turns, mirrors, released };
  }

  /** Switch to another posture. @param {Opened} opened */
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

  /** @param {any} answer */
  #take(answer) {
    const { rotations, root, known, corpus, standing, balance, words = "" } = answer;
    this.posture = { rotations, root };
    this.motion.take(this.posture);
    Object.assign(this, { known, corpus, standing, balance, words });
    this.turns = answer.turns ?? this.turns.map((turn, i) => ({ ...turn, degrees: answer.degrees[i] }));
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

/** Whether postures differ visibly. @param {Posture} a @param {Posture} b */
function differ(a, b) {
  const far = (/** @type {number[]} */ one, /** @type {number[]} */ other) => one.some((x, i) => Math.abs(x - other[i]) > 1e-5);
  return far(a.rotations, b.rotations) || far(a.root, b.root);
}
