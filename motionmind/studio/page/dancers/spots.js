/** Where the dancers begin: a spot on the floor for each, in the viewer, which is dragged or moved by keys. */

import { groundUnder } from "../asks/ground.js";
import { pixelOf } from "../view/pointing.js";

const STEP_M = 0.1; // places are multiples of this; a key moves by one
const CLICK_SLACK_PX = 4;
const KEYS = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] });

/** @typedef {[number, number]} Place */

/** The spots, while the panel is open. */
export class Spots {
  /** @param {any} cast */
  constructor(cast) {
    this.cast = cast;
    this.viewer = cast.studio.viewer;
    /** @type {Map<string, HTMLButtonElement>} by the dancers' ids */
    this.buttons = new Map();
    /** @type {{id: string, x: number, y: number, place: Place, moves: boolean} | null} */
    this.held = null;
    this.listening = new AbortController();
    const { signal } = this.listening;
    this.viewer.addEventListener("draw", () => this.#draw(), { signal });
    cast.addEventListener("change", () => this.viewer.stale(), { signal });
    this.viewer.stale();
  }

  /** Remove them. */
  close() {
    this.#drop();
    this.listening.abort();
    for (const button of this.buttons.values()) button.remove();
  }

  #draw() {
    const { viewer, cast } = this;
    const dancers = viewer.isHome && viewer.motion === cast.troupe ? cast.now.dancers : [];
    const { clientWidth: width, clientHeight: height } = viewer.overlay;
    for (const dancer of dancers) {
      const button = this.buttons.get(dancer.id) ?? this.#made(dancer.id);
      const { held } = this;
      const [x, z] = held && held.id === dancer.id ? held.place : dancer.place;
      const [left, top, depth] = pixelOf([x, 0, z], viewer.stage.camera, width, height);
      button.hidden = cast.hidden.has(dancer.id) || depth > 1;
      button.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px) translate(-50%, -50%)`;
      const words = `Place of ${dancer.name}: ${x.toFixed(1)} m to stage left, ${z.toFixed(1)} m downstage`;
      if (button.title !== words) Object.assign(button, { title: words, ariaLabel: words });
    }
    for (const [id, button] of this.buttons) {
      if (dancers.some((/** @type {any} */ one) => one.id === id)) continue;
      button.remove();
      this.buttons.delete(id);
    }
  }

  /** @param {string} id */
  #made(id) {
    const button = document.createElement("button");
    button.className = "spot";
    button.dataset.testid = `spot-${id}`;
    button.style.borderColor = `rgb(${this.cast.troupe.dancers.find((/** @type {any} */ one) => one.id === id)?.colour.join() ?? "0,0,0"})`;
    button.addEventListener("pointerdown", (event) => this.#take(event, id));
    button.addEventListener("pointermove", (event) => this.#move(event));
    button.addEventListener("pointerup", () => this.#put());
    button.addEventListener("pointercancel", () => this.#drop());
    button.addEventListener("keydown", (event) => this.#press(event, id));
    this.viewer.overlay.append(button);
    this.buttons.set(id, button);
    return button;
  }

  /** @param {PointerEvent} event @param {string} id */
  #take(event, id) {
    const dancer = this.cast.now.dancers.find((/** @type {any} */ one) => one.id === id);
    if (event.button !== 0 || !dancer) return;
    /** @type {Element} */ (event.currentTarget).setPointerCapture(event.pointerId);
    this.held = { id, x: event.clientX, y: event.clientY, place: dancer.place, moves: false };
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const { held } = this;
    if (!held) return;
    held.moves ||= Math.hypot(event.clientX - held.x, event.clientY - held.y) >= CLICK_SLACK_PX;
    const under = held.moves && groundUnder(event, this.viewer.overlay, this.viewer.stage);
    if (!under) return;
    held.place = [rounded(under[0]), rounded(under[2])];
    this.#show(held.id, held.place);
  }

  #put() {
    const { held } = this;
    this.held = null;
    if (!held?.moves) return;
    const { id, place } = held;
    this.cast.change(id, () => ({ place })).then(() => this.#shown(id)); // it may have been refused
  }

  #drop() {
    const { held } = this;
    this.held = null;
    if (held) this.#shown(held.id);
  }

  /** @param {KeyboardEvent} event @param {string} id */
  #press(event, id) {
    if (event.key === "Escape" && this.held) this.#drop();
    else if (KEYS[event.key] && !event.altKey && !event.ctrlKey && !event.metaKey && !event.shiftKey) {
      const [dx, dz] = KEYS[event.key];
      this.cast.change(id, ({ place: [x, z] }) => ({ place: [rounded(x + dx * STEP_M), rounded(z + dz * STEP_M)] }));
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Show a dancer at its own place. @param {string} id */
  #shown(id) {
    const dancer = this.cast.now.dancers.find((/** @type {any} */ one) => one.id === id);
    if (dancer) this.#show(id, dancer.place);
  }

  /** Show a dancer from another place on. @param {string} id @param {Place} place */
  #show(id, place) {
    const dancer = this.cast.troupe?.dancers.find((/** @type {any} */ one) => one.id === id);
    if (dancer) dancer.place = place;
    this.viewer.stale();
  }
}

/** @param {number} metres */
function rounded(metres) {
  return Math.round(metres / STEP_M) / Math.round(1 / STEP_M);
}
