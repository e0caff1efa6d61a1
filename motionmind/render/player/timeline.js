/** The timeline: insertions with their moves and bridges, and a playhead that can be dragged. */

import { MOMENT } from "motionmind/motion";

const TRACK = { top: 15, height: 6 }; // CSS pixels
const BRIDGES = { top: 24, height: 4 };
const APART = 7; // CSS pixels between the ticks of frames, at least

export class Timeline {
  /**
   * @param {HTMLElement} element a slider, with a canvas, a playhead and a hint in it
   * @param {Player} player
   * @param {object} colours {inserted, bridged}
   */
  constructor(element, player, colours) {
    this.element = element;
    this.player = player;
    this.motion = player.motion;
    this.violet = `rgb(${colours.inserted.middle.join()})`;
    this.emerald = `rgb(${colours.bridged.join()})`;
    this.canvas = element.querySelector("canvas");
    this.playhead = element.querySelector(".playhead");
    this.hint = element.querySelector(".hint");
    element.addEventListener("pointerdown", (event) => this.#grab(event));
    element.addEventListener("pointermove", (event) => this.#hover(event));
    element.addEventListener("pointerleave", () => this.#leave());
    this.insertions = this.#insertions();
    element.setAttribute("aria-valuemin", this.motion.start);
    element.setAttribute("aria-valuemax", this.motion.end);
    player.addEventListener("change", () => this.update());
    new ResizeObserver(() => this.draw()).observe(element);
  }

  /** Move the playhead to the player's time. */
  update() {
    const { time, frame } = this.player;
    this.playhead.style.left = `${100 * this.#share(time)}%`;
    this.element.setAttribute("aria-valuenow", time.toFixed(3));
    const words = [`frame ${this.motion.first + frame}`, `${time.toFixed(2)} seconds`, ...this.#inserted(time)];
    this.element.setAttribute("aria-valuetext", words.join(", "));
  }

  /** Draw all but the playhead. */
  draw() {
    const { clientWidth: width, clientHeight: height } = this.element;
    const ratio = window.devicePixelRatio;
    Object.assign(this.canvas, { width: width * ratio, height: height * ratio });
    const pen = this.canvas.getContext("2d");
    pen.scale(ratio, ratio);
    const x = (time) => width * this.#share(time);
    const box = (colour, from, to, { top, height: tall }, least) => {
      pen.fillStyle = colour;
      pen.fillRect(x(from), top, Math.max(x(to) - x(from), least), tall);
    };
    const grey = getComputedStyle(this.canvas).color;
    box(grey, this.motion.start, this.motion.end, TRACK, 0);
    if (width / this.motion.length >= APART) {
      pen.fillStyle = grey;
      for (const time of this.motion.times) pen.fillRect(x(time) - 0.5, TRACK.top - 5, 1, 3);
    }
    for (const { times, bridged } of this.motion.insertions) {
      box(this.violet, times[0], times.at(-1), TRACK, 2);
      for (const time of times) pen.fillRect(x(time) - 0.75, TRACK.top - 7, 1.5, TRACK.height + 7);
      for (const { move } of bridged) box(this.emerald, times[move], times[move + 1], BRIDGES, 2);
    }
  }

  #share(time) {
    return (time - this.motion.start) / (this.motion.end - this.motion.start);
  }

  #timeAt(event) {
    const { left, width } = this.element.getBoundingClientRect();
    const share = Math.min(Math.max((event.clientX - left) / width, 0), 1);
    return this.motion.start + share * (this.motion.end - this.motion.start);
  }

  /** Lay a button on each insertion for keys; the pointer passes through to the timeline and drags. */
  #insertions() {
    const group = document.createElement("div");
    group.className = "insertions";
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", "Insertions");
    group.hidden = this.motion.insertions.length === 0;
    const buttons = this.motion.insertions.map(({ times }, i) => {
      const [from, to] = [times[0], times.at(-1)].map((time) => Math.min(Math.max(this.#share(time), 0), 1));
      const button = document.createElement("button");
      button.style.left = `${100 * from}%`;
      button.style.width = `${100 * (to - from)}%`;
      button.tabIndex = i === 0 ? 0 : -1; // one tab stop; arrows move between the buttons
      button.setAttribute("aria-label", this.#described(i).join(", "));
      button.addEventListener("click", () => this.player.seek(times[0]));
      button.addEventListener("focus", () => {
        for (const other of buttons) other.tabIndex = other === button ? 0 : -1;
        this.#hint(this.#described(i), 0.5 * (from + to));
      });
      button.addEventListener("blur", () => this.#leave());
      return button;
    });
    group.addEventListener("keydown", (event) => {
      const at = buttons.indexOf(event.target);
      const next = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: buttons.length - 1 }[event.key];
      if (next === undefined || event.shiftKey || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      event.stopPropagation(); // frames stay
      buttons[next]?.focus();
    });
    group.append(...buttons);
    this.element.after(group);
    return buttons;
  }

  /** Describe an insertion. */
  #described(index) {
    const { times, bridged } = this.motion.insertions[index];
    const moves = times.length - 1;
    const words = [
      this.#name(index),
      `${times[0].toFixed(2)} to ${times.at(-1).toFixed(2)} s`,
      moves === 1 ? "1 move" : `${moves} moves`,
    ];
    const joints = new Set(bridged.map(({ joint }) => this.motion.joints[joint]));
    if (joints.size > 0) words.push(`bridged: ${[...joints].join(", ")}`);
    return words;
  }

  #name(index) {
    const { length } = this.motion.insertions;
    return length === 1 ? "insertion" : `insertion ${index + 1} of ${length}`;
  }

  /** The name of the insertion at `time`, and its move; empty outside insertions. */
  #inserted(time) {
    const index = this.motion.insertions.indexOf(this.motion.insertionAt(time));
    if (index < 0) return [];
    const { times } = this.motion.insertions[index];
    const move = times.findLastIndex((start, i) => i < times.length - 1 && start <= time + MOMENT);
    return [this.#name(index), ...(move < 0 ? [] : [`move ${move + 1} of ${times.length - 1}`])];
  }

  #grab(event) {
    if (event.button !== 0) return;
    this.element.setPointerCapture(event.pointerId);
    this.player.pause();
    this.player.seek(this.#timeAt(event));
    this.#hover(event);
  }

  #hover(event) {
    const time = this.#timeAt(event);
    if (this.element.hasPointerCapture(event.pointerId)) this.player.seek(time);
    const bridged = this.motion.bridgedAt(time).map((joint) => this.motion.joints[joint]);
    const words = [`${time.toFixed(2)} s`, `frame ${this.motion.first + this.motion.frameAt(time)}`, ...this.#inserted(time)];
    if (bridged.length > 0) words.push(`bridged: ${bridged.join(", ")}`);
    this.#hint(words, this.#share(time));
    const under = this.motion.insertions.indexOf(this.motion.insertionAt(time));
    this.insertions.forEach((button, i) => button.classList.toggle("under", i === under));
  }

  /** Show text over the timeline at a `share` of its width from the left, within the page. */
  #hint(words, share) {
    this.hint.textContent = words.join(" · ");
    this.hint.hidden = false;
    const { clientWidth: width } = this.element;
    const half = this.hint.offsetWidth / 2;
    this.hint.style.left = `${Math.max(Math.min(width * share, width - half), half)}px`;
  }

  #leave() {
    this.hint.hidden = true;
    for (const button of this.insertions) button.classList.remove("under");
  }
}
