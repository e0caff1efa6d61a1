/** The handles over the view: a button on each joint or heel to drag, a mark on every other joint. */

import { Vector3 } from "three";
import { keyStep, pixelOf, placeUnder } from "../view/pointing.js";
import { BalanceMark } from "./balance.js";

const HEEL_DISTANCE_PX = 32; // of its handle from its foot's: half of both
const KEY_PAUSE_MS = 400; // without a key, which ends a step
const WORDS = { seen: "seen", near: "nearly seen", unseen: "never seen" };
export class Handles {
  /** @param {import("./session.js").Editor} editor */
  constructor(editor) {
    this.editor = editor;
    this.viewer = editor.studio.viewer;
    this.element = Object.assign(document.createElement("div"), { className: "pose-handles" });
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Handles of the body");
    this.viewer.overlay.append(this.element);
    this.balance = new BalanceMark();
    /** @type {{element: HTMLElement, point: import("./session.js").Handle}[]} one for each joint, then the heels */
    this.marks = [];
    /** @type {{joint: string, plane: Vector3, away: Vector3, moved: boolean} | null} */
    this.held = null;
    /** @type {{joint: string, place: number[]} | null} target of a handle that keys move */
    this.goal = null;
    this.pause = 0;
    this.listening = new AbortController();
    const { signal } = this.listening;
    this.viewer.addEventListener("draw", () => this.#follow(), { signal });
    this.viewer.addEventListener("show", () => this.#appear(), { signal });
    editor.addEventListener("open", () => this.#make(), { signal });
    editor.addEventListener("change", () => this.#label(), { signal });
    this.#make();
  }

  /** Take the handles away. */
  remove() {
    this.listening.abort();
    this.element.remove();
  }

  #make() {
    const { editor } = this;
    const handles = new Map(editor.handles.map((handle) => [handle.joint, handle]));
    const joints = editor.joints.map(({ joint }) => handles.get(joint) ?? bare(joint));
    const heels = editor.handles.filter(({ joint, on }) => joint !== on);
    this.marks = [...joints, ...heels].map((point) => ({ point, element: point.words ? this.#handle(point) : mark() }));
    // The Tab key follows this order.
    this.element.replaceChildren(this.balance.element, ...this.marks.map(({ element }) => element));
    for (const { joint, on } of heels) {
      this.#markOf(joint)?.classList.add("heel");
      this.#markOf(on)?.classList.add("foot");
    }
    this.#appear();
    this.#label();
  }

  /** @param {string} joint */
  #markOf(joint) {
    return this.marks.find(({ point }) => point.joint === joint)?.element;
  }

  /** Where a handle is seen: a foot's in the middle of the foot, apart from its heel. @param {import("./session.js").Handle} point */
  #seen(point) {
    const { body, joints } = this.editor.motion;
    const place = this.editor.place(point);
    if (!this.#markOf(point.joint)?.classList.contains("foot")) return place;
    const toes = body.parents.indexOf(joints.indexOf(point.on));
    const end = toes < 0 ? place : body.place(toes, [0, 0, 0]);
    return place.map((x, i) => (x + end[i]) / 2);
  }

  #appear() {
    this.element.hidden = !this.editor.shown;
    this.viewer.stale();
  }

  /** @param {import("./session.js").Handle} point */
  #handle(point) {
    const { joint, words, on } = point;
    const handle = document.createElement("button");
    Object.assign(handle, { type: "button", className: "pose-handle", title: words });
    handle.dataset.testid = `handle-${joint}`;
    handle.append(mark());
    handle.addEventListener("focus", () => this.editor.select(on));
    handle.addEventListener("pointerdown", (event) => this.#hold(event, handle, point));
    handle.addEventListener("pointermove", (event) => this.#move(event, words));
    for (const over of ["pointerup", "pointercancel", "lostpointercapture"]) {
      handle.addEventListener(over, () => this.#release());
    }
    handle.addEventListener("keydown", (event) => this.#press(event, point));
    return handle;
  }

  /** Label each joint with how well the corpus knows it. */
  #label() {
    const { known, selected, joints, busy } = this.editor;
    this.element.ariaBusy = String(busy);
    const at = new Map(joints.map(({ joint }, i) => [joint, i]));
    for (const { element, point } of this.marks) {
      const how = known[/** @type {number} */ (at.get(point.on))] ?? "seen";
      element.dataset.known = known.length ? how : "";
      if (!point.words) continue;
      const words = known.length ? `${point.words}: ${WORDS[how]}` : point.words;
      if (element.getAttribute("aria-label") !== words) element.setAttribute("aria-label", words);
      element.classList.toggle("selected", point.joint === selected);
    }
  }

  /** Move the handles to their joints in the view. */
  #follow() {
    const { editor, viewer } = this;
    if (!editor.shown || !viewer.stage) return;
    const { camera } = viewer.stage;
    const { clientWidth: width, clientHeight: height } = this.element;
    this.balance.follow(editor.balance, camera, width, height);
    const places = new Map();
    for (const { element, point } of this.marks) {
      const [x, y, depth] = pixelOf(this.#seen(point), camera, width, height);
      places.set(element, [x, y]);
      element.style.zIndex = String(1001 - Math.round(1000 * depth)); // the nearest is on top
    }
    for (const { element, point } of this.marks) {
      const foot = point.joint === point.on ? null : this.#markOf(point.on); // over its heel, which is beside it
      if (foot) element.style.zIndex = String(Number(foot.style.zIndex) - 1);
      const [x, y] = foot ? beside(places.get(element), places.get(foot)) : places.get(element);
      element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
    }
  }

  /** @param {PointerEvent} event @param {HTMLElement} handle @param {import("./session.js").Handle} point */
  #hold(event, handle, point) {
    if (event.button !== 0) return;
    event.preventDefault();
    handle.focus({ preventScroll: true });
    handle.setPointerCapture(event.pointerId);
    const plane = new Vector3().fromArray(this.editor.place(point));
    this.held = { joint: point.joint, plane, away: new Vector3(), moved: false };
    this.held.away.copy(plane).sub(placeUnder(event, this.element, this.viewer.stage.camera, plane) ?? plane);
  }

  /** @param {PointerEvent} event @param {string} words */
  #move(event, words) {
    const { held } = this;
    const place = held && placeUnder(event, this.element, this.viewer.stage.camera, held.plane);
    if (!held || !place) return;
    held.moved = true;
    this.editor.drag(held.joint, place.add(held.away).toArray(), words);
  }

  #release() {
    const { held } = this;
    this.held = null;
    if (held?.moved) this.editor.end();
  }

  /** @param {KeyboardEvent} event @param {import("./session.js").Handle} point */
  #press(event, point) {
    const { joint, words } = point;
    const { editor } = this;
    const towards = keyStep(event, this.viewer.stage.camera, editor.motion.body.size);
    if (!towards) return;
    event.preventDefault();
    event.stopPropagation();
    // Keys in quick succession continue from the last target, and make one step.
    const from = editor.began && this.goal?.joint === joint ? this.goal.place : editor.place(point);
    this.goal = { joint, place: new Vector3(...from).add(towards).toArray() };
    editor.drag(joint, this.goal.place, words);
    clearTimeout(this.pause);
    this.pause = setTimeout(() => editor.end(), KEY_PAUSE_MS);
  }
}

/** Where a heel's handle is seen: moved away from its foot's, below it from the front, until neither covers the other. */
function beside(/** @type {number[]} */ [x, y], /** @type {number[]} */ [footX, footY]) {
  const distance = Math.hypot(x - footX, y - footY);
  if (distance >= HEEL_DISTANCE_PX) return [x, y];
  const [acrossRatio, alongRatio] = distance > 1 ? [(x - footX) / distance, (y - footY) / distance] : [0, 1];
  return [footX + HEEL_DISTANCE_PX * acrossRatio, footY + HEEL_DISTANCE_PX * alongRatio];
}

/** A joint without a handle. @param {string} joint @returns {import("./session.js").Handle} */
function bare(joint) {
  return { joint, words: "", on: joint, at: [0, 0, 0] };
}

function mark() {
  const element = Object.assign(document.createElement("span"), { className: "pose-mark" });
  element.setAttribute("aria-hidden", "true");
  return element;
}
