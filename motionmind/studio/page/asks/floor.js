/** The path that an insertion follows over the floor: drawn in the viewer, dragged by its points, and moved by keys. */

import { html, useEffect } from "../vendor/htm-preact-standalone.js";
import { perStudio, useChange } from "../shell/hooks.js";
import { pixelOf } from "../view/pointing.js";
import { askedOf, fromScene, MAX_POINTS, millimetre, toScene } from "./asked.js";
import { groundStep, groundUnder, isSteep, simplified } from "./ground.js";

const SVG = "http://www.w3.org/2000/svg";
const CLICK_PX = 6; // a shorter line is a click
const KEY_PAUSE_MS = 400; // without a key, which ends a step
const NEXT_M = 0.5; // from the last point to one that a key adds
const PIECES = 24; // of a straight line, which may pass behind the camera
const ARROW_M = 0.45;
const AROUND_RATIO = 1.8; // by how much farther away the camera looks to draw
/** @typedef {[number, number, number]} Place in the viewer's scene */

const floorOf = perStudio((studio) => new Floor(studio));

/** Fires "change". */
class Floor extends EventTarget {
  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    this.viewer = studio.viewer;
    /** Whether the pointer draws. */
    this.drawing = false;
    /** @type {import("./asked.js").Asked | null} */
    this.asked = null;
    /** @type {Place[] | null} points on their way to others */
    this.draft = null;
    /** @type {{line: Place[], x: number, y: number, isClick: boolean} | null} */
    this.stroke = null;
    /** @type {{index: number, away: number[], moved: boolean} | null} */
    this.held = null;
    this.pause = 0;
    /** @type {HTMLElement[]} a button for each point */
    this.handles = [];
    this.element = made("div", "floor-asked");
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Path over the floor");
    const lines = this.element.appendChild(document.createElementNS(SVG, "svg"));
    lines.setAttribute("aria-hidden", "true");
    this.path = lines.appendChild(document.createElementNS(SVG, "path"));
    this.arrow = lines.appendChild(document.createElementNS(SVG, "path"));
    this.viewer.overlay.append(this.element);
    const take = () => queueMicrotask(() => this.#take());
    studio.store.addEventListener("change", take);
    this.viewer.addEventListener("show", take);
    this.viewer.addEventListener("draw", () => this.#follow());
    const [half] = this.viewer.halves;
    // Before the camera's controls, which listen on the canvas; the wheel still zooms.
    half.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => this.#begin(event), { capture: true });
    half.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => this.#draw(event));
    half.addEventListener("pointerup", () => this.#end());
    half.addEventListener("pointercancel", () => (this.stroke = null));
    addEventListener("keydown", (event) => this.#finish(event), { capture: true });
    take();
  }

  /** The points in the scene. @returns {Place[]} */
  get points() {
    const { asked, draft } = this;
    return draft ?? (asked?.ask.travel?.points ?? []).map(([x, z]) => toScene(/** @type {any} */ (asked), [x, 0, z]));
  }

  /** Where the insertion begins. @returns {Place} */
  get start() {
    return toScene(/** @type {any} */ (this.asked), [0, 0, 0]);
  }

  /** Draw with the pointer, or end that and ask for what is drawn. */
  toggle() {
    if (this.drawing) {
      this.#mode(false);
      this.commit();
      return;
    }
    this.viewer.player.pause();
    const { stage } = this.viewer;
    if (!isSteep(stage)) {
      this.viewer.look("top");
      const { position } = stage.camera;
      position.sub(stage.controls.target).multiplyScalar(AROUND_RATIO).add(stage.controls.target);
      stage.controls.update();
    }
    this.#mode(true);
  }

  /** Add a point by a key, for the arrow keys to move. */
  add() {
    const points = this.points;
    if (points.length >= MAX_POINTS) return;
    const [x, , z] = points.at(-1) ?? this.start;
    this.draft = [...points, [x, 0, z + NEXT_M]];
    this.#show();
    this.handles.at(-1)?.focus();
    this.commit();
  }

  /** Ask for the points that have changed. */
  async commit() {
    clearTimeout(this.pause);
    this.pause = 0;
    const { asked, draft } = this;
    if (!asked?.draw || !draft) return;
    const points = draft.map((place) => fromScene(asked, place)).map(([x, , z]) => [millimetre(x), millimetre(z)]);
    const facing = asked.ask.travel?.facing ?? null;
    await asked.draw(points.length > 0 ? { points: /** @type {[number, number][]} */ (points), facing } : null);
    if (this.draft === draft) this.draft = null;
    this.#show();
  }

  /** @param {boolean} drawing */
  #mode(drawing) {
    this.drawing = drawing;
    this.stroke = null;
    this.viewer.halves[0].classList.toggle("drawing", drawing);
    this.dispatchEvent(new Event("change"));
  }

  #take() {
    const asked = askedOf(this.studio);
    const usable = asked?.draw && !asked.locked ? asked : null;
    if (usable?.name !== this.asked?.name) {
      if (this.pause) this.commit(); // what keys moved last
      this.draft = null;
      if (this.drawing) this.#mode(false);
    }
    const changed = JSON.stringify(usable) !== JSON.stringify(this.asked);
    this.asked = usable;
    if (changed) this.#show();
  }

  /** Make a handle for each point. */
  #show() {
    const { points } = this;
    this.element.hidden = !this.asked;
    while (this.handles.length > points.length) this.handles.pop()?.remove();
    while (this.handles.length < points.length) {
      this.handles.push(this.#handle(this.handles.length));
      this.element.append(this.handles[this.handles.length - 1]); // the others stay, and one of them keeps the focus
    }
    this.handles.forEach((handle, i) => {
      const last = i === points.length - 1;
      const label = last ? "The insertion ends here" : `Point ${i + 1} of the path`;
      handle.setAttribute("aria-label", `${label}: arrow keys move it, Enter adds a point, Delete removes it.`);
      handle.classList.toggle("last", last);
      /** @type {HTMLElement} */ (handle.lastChild).textContent = last ? "ends here" : "";
    });
    this.dispatchEvent(new Event("change"));
    this.viewer.stale();
  }

  /** A button to drag a point. @param {number} index */
  #handle(index) {
    const handle = /** @type {HTMLButtonElement} */ (made("button", "reach-handle floor-handle"));
    handle.type = "button";
    handle.dataset.testid = `floor-point-${index + 1}`;
    handle.append(made("i", ""), made("span", "words"));
    handle.addEventListener("pointerdown", (event) => this.#hold(event, handle, index));
    handle.addEventListener("pointermove", (event) => this.#move(event));
    for (const over of ["pointerup", "pointercancel", "lostpointercapture"]) handle.addEventListener(over, () => this.#release());
    handle.addEventListener("keydown", (event) => this.#press(event, index));
    return handle;
  }

  /** @param {PointerEvent} event @param {HTMLElement} handle @param {number} index */
  #hold(event, handle, index) {
    if (event.button !== 0) return;
    event.preventDefault();
    handle.focus({ preventScroll: true });
    handle.setPointerCapture(event.pointerId);
    const [x, , z] = this.points[index];
    const [underX, , underZ] = groundUnder(event, this.element, this.viewer.stage) ?? [x, 0, z];
    this.held = { index, away: [x - underX, z - underZ], moved: false };
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const { held } = this;
    const place = held && groundUnder(event, this.element, this.viewer.stage);
    if (!held || !place) return;
    held.moved = true;
    this.#put(held.index, [place[0] + held.away[0], 0, place[2] + held.away[1]]);
  }

  #release() {
    const { held } = this;
    this.held = null;
    if (held?.moved && !this.drawing) this.commit();
  }

  /** @param {number} index @param {Place} place */
  #put(index, place) {
    this.draft = this.points.map((one, i) => (i === index ? place : one));
    this.viewer.stale();
  }

  /** @param {KeyboardEvent} event @param {number} index */
  #press(event, index) {
    const step = groundStep(event, this.viewer.stage.camera, this.viewer.motion.body.size);
    if (event.key === "Delete" || event.key === "Backspace") {
      this.draft = this.points.filter((_, i) => i !== index);
      this.#show();
      (this.handles[Math.min(index, this.handles.length - 1)] ?? this.viewer.element.querySelector("canvas")).focus();
      this.commit();
    } else if (event.key === "Enter") this.add();
    else if (step) {
      const [x, , z] = this.points[index];
      this.#put(index, [x + step[0], 0, z + step[1]]);
      clearTimeout(this.pause);
      this.pause = setTimeout(() => this.commit(), KEY_PAUSE_MS);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {PointerEvent} event */
  #begin(event) {
    if (!this.drawing || event.button !== 0) return;
    event.preventDefault();
    event.stopPropagation();
    const place = groundUnder(event, this.element, this.viewer.stage);
    if (!place) return;
    this.viewer.halves[0].setPointerCapture(event.pointerId);
    this.stroke = { line: [place], x: event.clientX, y: event.clientY, isClick: true };
  }

  /** @param {PointerEvent} event */
  #draw(event) {
    const { stroke } = this;
    const place = stroke && groundUnder(event, this.element, this.viewer.stage);
    if (!stroke || !place) return;
    if (Math.hypot(event.clientX - stroke.x, event.clientY - stroke.y) >= CLICK_PX) stroke.isClick = false;
    stroke.line.push(place);
    this.viewer.stale();
  }

  /** Add a point for a click; ask for a path that is drawn. */
  #end() {
    const { stroke } = this;
    this.stroke = null;
    if (!stroke) return;
    if (stroke.isClick) this.draft = [...this.points, stroke.line[0]].slice(0, MAX_POINTS);
    else this.draft = simplified([this.start, ...stroke.line], MAX_POINTS + 1).slice(1);
    this.#show();
    if (!stroke.isClick) this.toggle();
  }

  /** @param {KeyboardEvent} event */
  #finish(event) {
    if (!this.drawing || !["Escape", "Enter"].includes(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === "Enter") {
      this.toggle();
      return;
    }
    this.draft = null;
    this.#mode(false);
    this.#show();
  }

  /** Move everything to where it is seen. */
  #follow() {
    const { asked, viewer, stroke, points } = this;
    if (!asked || !viewer.stage) return;
    const { clientWidth: width, clientHeight: height } = this.element;
    const seen = (/** @type {number[]} */ place) => pixelOf(place, viewer.stage.camera, width, height);
    points.forEach((place, i) => {
      if (!this.handles[i]) return;
      const [x, y, depth] = seen(place);
      this.handles[i].style.visibility = depth < 1 ? "" : "hidden"; // behind the camera
      this.handles[i].style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
    });
    const line = stroke && !stroke.isClick ? stroke.line : points;
    this.path.setAttribute("d", line.length > 0 ? drawn([this.start, ...line], seen) : "");
    const facing = asked.ask.travel?.facing ?? null;
    this.arrow.setAttribute("d", facing === null || points.length === 0 ? "" : this.#facing(facing, seen));
  }

  /** An arrow from the last point to where the body faces there. @param {number} degrees @param {(place: number[]) => number[]} seen */
  #facing(degrees, seen) {
    const asked = /** @type {import("./asked.js").Asked} */ (this.asked);
    const [x, , z] = fromScene(asked, /** @type {Place} */ (this.points.at(-1)));
    const size = ARROW_M * this.viewer.motion.body.size;
    const at = (/** @type {number} */ far, /** @type {number} */ turned) => {
      const angle = ((degrees + turned) * Math.PI) / 180;
      return toScene(asked, [x + far * size * Math.sin(angle), 0, z + far * size * Math.cos(angle)]);
    };
    const tip = at(1, 0);
    return [[at(0, 0), tip], [at(0.75, 12), tip], [at(0.75, -12), tip]].map((pair) => drawn(pair, seen)).join("");
  }
}

/** Straight lines as a path of SVG, without what is behind the camera. @param {number[][]} places @param {(place: number[]) => number[]} seen */
function drawn(places, seen) {
  let [path, pen] = ["", "M"];
  const put = (/** @type {number[]} */ place) => {
    const [x, y, depth] = seen(place);
    if (depth < 1) path += `${pen}${x.toFixed(1)},${y.toFixed(1)}`;
    pen = depth < 1 ? "L" : "M";
  };
  places.forEach((place, i) => {
    if (i === 0) put(place);
    else for (let k = 1; k <= PIECES; k++) put(place.map((to, axis) => places[i - 1][axis] + ((to - places[i - 1][axis]) * k) / PIECES));
  });
  return path;
}

/** The button that draws, and how near the insertion keeps to the path. @param {{studio: any}} props */
export function FloorTools({ studio }) {
  const floor = floorOf(studio);
  const drawing = useChange(floor, () => floor.drawing);
  const asked = useChange(floor, () => floor.asked);
  const count = useChange(floor, () => floor.points.length);
  useEffect(() => () => floor.drawing && floor.toggle(), []);
  if (!asked) return null;
  return html`<div class="floor-tools">
    ${
      drawing
        ? html`<p class="card hint" role="status">Drag a path from the body on, or click points. Enter ends, Escape leaves it as it was.</p>`
        : count > 0 && html`<p class="card hint" role="status" data-testid="floor-off">${asked.off}</p>`
    }
    <button class="button" data-testid="floor-draw" aria-pressed=${String(drawing)} title="The path of this insertion, and where it ends"
      onClick=${(/** @type {MouseEvent} */ event) => (event.detail > 0 || drawing ? floor.toggle() : floor.add())}>
      ${drawing ? "Done" : "Draw on the floor"}
    </button>
  </div>`;
}

/** @param {string} tag @param {string} name */
function made(tag, name) {
  return Object.assign(document.createElement(tag), { className: name });
}
