/** The handles over the view: a button on each joint or heel to drag, a mark on every other joint. */

import { Vector3 } from "three";

const KEY_STEP_M = 0.01; // for a body of human size; with Shift five times as far
const KEY_PAUSE_MS = 400; // without a key, which ends a step
const WORDS = { seen: "seen", near: "nearly seen", unseen: "never seen" };
const DIRECTIONS = /** @type {Record<string, number[]>} */ ({
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, -1], // away from the viewer
  PageDown: [0, 0, 1],
});

export class Handles {
  /** @param {import("./session.js").Editor} editor */
  constructor(editor) {
    this.editor = editor;
    this.viewer = editor.studio.viewer;
    this.element = Object.assign(document.createElement("div"), { className: "pose-handles" });
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Handles of the body");
    this.viewer.overlay.append(this.element);
    /** @type {{element: HTMLElement, point: import("./session.js").Handle}[]} one for each joint, then the heels */
    this.marks = [];
    this.point = new Vector3();
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
    this.element.replaceChildren(...this.marks.map(({ element }) => element));
    this.#appear();
    this.#label();
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
    for (const { element, point } of this.marks) {
      this.point.fromArray(editor.place(point)).project(camera);
      const [x, y] = [0.5 * (this.point.x + 1) * width, 0.5 * (1 - this.point.y) * height];
      element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
      element.style.zIndex = String(1000 - Math.round(1000 * this.point.z)); // the nearest is on top
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
    this.held.away.copy(plane).sub(this.#under(event, plane) ?? plane);
  }

  /** @param {PointerEvent} event @param {string} words */
  #move(event, words) {
    const { held } = this;
    const place = held && this.#under(event, held.plane);
    if (!held || !place) return;
    held.moved = true;
    this.editor.drag(held.joint, place.add(held.away).toArray(), words);
  }

  #release() {
    const { held } = this;
    this.held = null;
    if (held?.moved) this.editor.end();
  }

  /** The position under the pointer in the plane through `place` that faces the camera. @param {PointerEvent} event @param {Vector3} place */
  #under(event, place) {
    const { camera } = this.viewer.stage;
    const { left, top, width, height } = this.element.getBoundingClientRect();
    const x = (2 * (event.clientX - left)) / width - 1;
    const y = 1 - (2 * (event.clientY - top)) / height;
    const ray = new Vector3(x, y, 0.5).unproject(camera).sub(camera.position).normalize();
    const facing = camera.getWorldDirection(new Vector3());
    const along = ray.dot(facing);
    if (along < 1e-6) return null;
    return ray.multiplyScalar(place.clone().sub(camera.position).dot(facing) / along).add(camera.position);
  }

  /** @param {KeyboardEvent} event @param {import("./session.js").Handle} point */
  #press(event, point) {
    const { joint, words } = point;
    const direction = DIRECTIONS[event.key];
    if (!direction || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const { editor } = this;
    const distance = KEY_STEP_M * editor.motion.body.size * (event.shiftKey ? 5 : 1);
    const towards = new Vector3(...direction).applyQuaternion(this.viewer.stage.camera.quaternion).multiplyScalar(distance);
    // Keys in quick succession continue from the last target, and make one step.
    const from = editor.began && this.goal?.joint === joint ? this.goal.place : editor.place(point);
    this.goal = { joint, place: new Vector3(...from).add(towards).toArray() };
    editor.drag(joint, this.goal.place, words);
    clearTimeout(this.pause);
    this.pause = setTimeout(() => editor.end(), KEY_PAUSE_MS);
  }
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
