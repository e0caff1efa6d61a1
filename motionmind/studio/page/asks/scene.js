/** The wishes for an insertion in the viewer's scene: places to reach, which can be dragged, pins, and postures to pass. */

import { Vector3 } from "three";
import { movement } from "../movements.js";
import { deskOf } from "../between/desk.js";
import { useEffect } from "../vendor/htm-preact-standalone.js";
import { limbName } from "../timeline/blocks.js";
import { keyStep, pixelOf, placeUnder } from "../view/pointing.js";
import { askedOf, fromScene, jointAt, rounded, toScene, within } from "./asked.js";
import { passedAt } from "./waypoints.js";

const SVG = "http://www.w3.org/2000/svg";
const KEY_PAUSE_MS = 400; // without a key, which ends a step
const KEY_TIME_STEP_S = 0.1;

/** Draw the wishes over the viewer. @param {{studio: any}} props */
export function Asked({ studio }) {
  useEffect(() => {
    const scene = new Scene(studio);
    return () => scene.remove();
  }, []);
  return null;
}

class Scene {
  /** @param {any} studio */
  constructor(studio) {
    this.studio = studio;
    this.viewer = studio.viewer;
    this.element = made("div", "asked");
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Wishes for the insertion");
    this.lines = document.createElementNS(SVG, "svg");
    this.lines.setAttribute("aria-hidden", "true");
    this.path = this.lines.appendChild(document.createElementNS(SVG, "path"));
    this.others = made("div", "");
    this.element.append(this.lines, this.others);
    this.viewer.overlay.append(this.element);
    /** @type {import("./asked.js").Asked | null} */
    this.asked = null;
    this.shown = ""; // what is drawn
    /** @type {HTMLElement[]} a button for each place to reach */
    this.handles = [];
    /** @type {{element: HTMLElement, place: () => number[] | null}[]} */
    this.marks = [];
    /** @type {{index: number, place: number[], at: number} | null} a place on the way to another one, in the scene */
    this.draft = null;
    /** @type {{plane: Vector3, away: Vector3, moved: boolean} | null} */
    this.held = null;
    this.pause = 0;
    this.listening = new AbortController();
    const { signal } = this.listening;
    const take = () => queueMicrotask(() => signal.aborted || this.#take()); // once the desk and the viewer agree
    studio.store.addEventListener("change", take, { signal });
    deskOf(studio).addEventListener("change", take, { signal });
    this.viewer.addEventListener("show", take, { signal });
    this.viewer.addEventListener("draw", () => this.#follow(), { signal });
    take();
  }

  remove() {
    this.listening.abort();
    this.element.remove();
  }

  /** Draw what is asked now. */
  #take() {
    const asked = askedOf(this.studio);
    this.asked = asked;
    const shown = asked ? JSON.stringify([asked, this.viewer.motion.name, this.viewer.motion.end]) : "";
    if (shown === this.shown) return;
    const same = asked && JSON.parse(this.shown || "[{}]")[0].name === asked.name;
    this.shown = shown;
    if (!same) this.draft = null;
    this.element.hidden = !asked;
    this.#make(asked);
    this.#pass(asked);
    this.viewer.stale();
  }

  /** @param {import("./asked.js").Asked | null} asked */
  #make(asked) {
    const reaches = asked?.ask.reaches ?? [];
    while (this.handles.length > reaches.length) this.handles.pop()?.remove();
    while (this.handles.length < reaches.length) {
      this.handles.push(this.#handle(this.handles.length));
      this.element.append(this.handles[this.handles.length - 1]); // the others stay, and one of them keeps the focus
    }
    reaches.forEach(({ joint, at }, i) => {
      const words = `${limbName(joint)} at ${at.toFixed(2)} s`;
      const label = `${words}: a place to reach. Arrow keys move it, Alt and arrow keys change its time, Delete removes it.`;
      this.handles[i].setAttribute("aria-label", label);
      /** @type {HTMLElement} */ (this.handles[i].lastChild).textContent = words;
      this.handles[i].toggleAttribute("disabled", asked?.locked);
    });
    this.marks = (asked?.ask.pins ?? []).map((pin) => ({
      element: mark("pin", `${limbName(pin.joint)} ${pin.hold === "place" ? "stays here" : "stays"}`),
      place: () => this.#pinned(/** @type {any} */ (asked), pin),
    }));
    this.others.replaceChildren(...this.marks.map(({ element }) => element));
  }

  /** Where a pin holds its joint: its place in the room, or the joint itself while the insertion goes on. */
  #pinned(/** @type {import("./asked.js").Asked} */ { begin, seconds }, /** @type {import("../timeline/items.js").Pin} */ { joint, hold, begins, ends }) {
    const { time } = this.viewer.player;
    if (hold === "place") return jointAt(this.viewer, joint, begin + seconds * (ends === 1 && begins > 0 ? 1 : begins));
    return begin <= time && time <= begin + seconds ? jointAt(this.viewer, joint, time) : null;
  }

  /** Draw where the insertion passes its postures. @param {import("./asked.js").Asked | null} asked */
  async #pass(asked) {
    const { viewer, shown } = this;
    const { motion } = viewer;
    const passing = asked?.ask.passing ?? [];
    const found = await Promise.all(
      passing.map(({ posture, frame }) =>
        movement(this.studio.api, posture).then(
          (one) => one.rotations.subarray(frame * one.joints.length * 4, (frame + 1) * one.joints.length * 4),
          () => null, // it is missing, as the time line says
        ),
      ),
    );
    if (shown !== this.shown || motion !== viewer.motion) return;
    const here = found.filter((one) => one?.length === motion?.joints.length * 4);
    const times = asked && here.length > 0 ? passedAt(motion, asked.begin, asked.begin + asked.seconds, here) : [];
    viewer.besides({ waypoints: times });
    times.forEach((time, i) => {
      const words = passing[found.indexOf(here[i])].posture.split("/").at(-1);
      const element = mark("waypoint", `passes ${words}`);
      this.marks.push({ element, place: () => highest(viewer, time) });
      this.others.append(element);
    });
  }

  /** A button to drag a place. @param {number} index */
  #handle(index) {
    const handle = /** @type {HTMLButtonElement} */ (made("button", "reach-handle"));
    handle.type = "button";
    handle.dataset.testid = `place-${index + 1}`;
    handle.append(made("i", ""), made("span", "words"));
    handle.addEventListener("pointerdown", (event) => this.#hold(event, handle, index));
    handle.addEventListener("pointermove", (event) => this.#move(event));
    for (const over of ["pointerup", "pointercancel", "lostpointercapture"]) handle.addEventListener(over, () => this.#release());
    handle.addEventListener("keydown", (event) => this.#press(event, index));
    return handle;
  }

  /** Begin to change a place; show the body at its time. @param {number} index */
  #begin(index) {
    const asked = /** @type {import("./asked.js").Asked} */ (this.asked);
    if (this.draft?.index !== index) {
      const { place, at } = asked.ask.reaches[index];
      this.draft = { index, place: toScene(asked, place), at };
    }
    this.viewer.player.pause();
    this.viewer.player.seek(asked.begin + this.draft.at);
    return this.draft;
  }

  /** Ask for the changed place. */
  async #commit() {
    clearTimeout(this.pause);
    const { draft, asked } = this;
    if (!draft || !asked) return;
    const place = rounded(fromScene(asked, draft.place));
    await asked.change((now) => now.map((one, i) => (i === draft.index ? { ...one, place, at: draft.at } : one)));
    if (this.draft === draft) this.draft = null;
    this.viewer.stale();
  }

  /** @param {PointerEvent} event @param {HTMLElement} handle @param {number} index */
  #hold(event, handle, index) {
    if (event.button !== 0 || !this.asked) return;
    event.preventDefault();
    handle.focus({ preventScroll: true });
    handle.setPointerCapture(event.pointerId);
    const plane = new Vector3().fromArray(this.#begin(index).place);
    const away = plane.clone().sub(placeUnder(event, this.element, this.viewer.stage.camera, plane) ?? plane);
    this.held = { plane, away, moved: false };
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const { held, draft } = this;
    const place = held && placeUnder(event, this.element, this.viewer.stage.camera, held.plane);
    if (!held || !place || !draft) return;
    held.moved = true;
    draft.place = place.add(held.away).toArray();
    this.viewer.stale();
  }

  #release() {
    const { held } = this;
    this.held = null;
    if (held?.moved) this.#commit();
    else if (held) this.draft = null;
  }

  /** @param {KeyboardEvent} event @param {number} index */
  #press(event, index) {
    const { asked } = this;
    if (!asked) return;
    const later = event.altKey && { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const step = keyStep(event, this.viewer.stage.camera, this.viewer.motion.body.size);
    if (event.key === "Delete" || event.key === "Backspace") {
      this.draft = null;
      this.viewer.element.querySelector("canvas").focus();
      asked.change((now) => now.filter((_, i) => i !== index));
    } else if (later || step) {
      const draft = this.#begin(index);
      if (step) draft.place = step.add(new Vector3().fromArray(draft.place)).toArray();
      if (later) draft.at = within(asked, draft.at + later * KEY_TIME_STEP_S) ?? draft.at;
      this.viewer.player.seek(asked.begin + draft.at);
      clearTimeout(this.pause);
      this.pause = setTimeout(() => this.#commit(), KEY_PAUSE_MS);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Move everything to where it is seen. */
  #follow() {
    const { asked, viewer, draft } = this;
    if (!asked || !viewer.stage || !viewer.motion) return;
    const { camera } = viewer.stage;
    const { clientWidth: width, clientHeight: height } = this.element;
    const missed = [];
    for (const [i, reach] of asked.ask.reaches.entries()) {
      const { place, at } = draft?.index === i ? draft : { place: toScene(asked, reach.place), at: reach.at };
      const [x, y] = pixelOf(place, camera, width, height);
      const [fromX, fromY] = pixelOf(jointAt(viewer, reach.joint, asked.begin + at), camera, width, height);
      missed.push(`M${fromX.toFixed(1)},${fromY.toFixed(1)}L${x.toFixed(1)},${y.toFixed(1)}`);
      move(this.handles[i], x, y);
    }
    this.path.setAttribute("d", missed.join(""));
    for (const { element, place } of this.marks) {
      const at = place();
      element.hidden = !at;
      const [x, y] = at ? pixelOf(at, camera, width, height) : [0, 0];
      move(element, x, y);
    }
  }
}

/** @param {string} tag @param {string} name */
function made(tag, name) {
  return Object.assign(document.createElement(tag), { className: name });
}

/** A mark with words beside it. @param {string} name @param {string} words */
function mark(name, words) {
  const element = made("span", `asked-mark ${name}`);
  element.append(made("i", ""), Object.assign(made("span", "words"), { textContent: words }));
  return element;
}

/** @param {HTMLElement} element @param {number} x @param {number} y */
function move(element, x, y) {
  element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
}

/** The position of the highest joint at a time. @param {any} viewer @param {number} time */
function highest({ motion }, time) {
  const { body, joints } = motion;
  const [rotations, root] = [new Float64Array(joints.length * 4), new Float64Array(3)];
  motion.sample(time, rotations, root);
  body.pose(rotations, root);
  const heights = joints.map((/** @type {string} */ _, /** @type {number} */ i) => body.joints[3 * i + 1]);
  const top = 3 * heights.indexOf(Math.max(...heights));
  return Array.from(body.joints.subarray(top, top + 3));
}
