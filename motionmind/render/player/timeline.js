/** The line of time: what the engine inserted on it, its moves and bridges, and the playhead, which can be dragged. */

const TRACK = { top: 15, height: 6 }; // CSS pixels
const BRIDGES = { top: 24, height: 4 };
const APART = 7; // CSS pixels between frames' ticks, at least

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
    element.addEventListener("pointerleave", () => (this.hint.hidden = true));
    element.setAttribute("aria-valuemin", this.motion.start);
    element.setAttribute("aria-valuemax", this.motion.end);
    player.addEventListener("change", () => this.update());
    new ResizeObserver(() => this.draw()).observe(element);
  }

  /** Put the playhead where the player is. */
  update() {
    const { time, frame } = this.player;
    this.playhead.style.left = `${100 * this.#share(time)}%`;
    this.element.setAttribute("aria-valuenow", time.toFixed(3));
    this.element.setAttribute("aria-valuetext", `frame ${this.motion.first + frame}, ${time.toFixed(2)} seconds`);
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

  #grab(event) {
    if (event.button !== 0) return;
    this.element.setPointerCapture(event.pointerId);
    this.player.pause();
    this.player.seek(this.#timeAt(event));
  }

  #hover(event) {
    const time = this.#timeAt(event);
    if (this.element.hasPointerCapture(event.pointerId)) this.player.seek(time);
    const bridged = this.motion.bridgedAt(time).map((joint) => this.motion.joints[joint]);
    const words = [`${time.toFixed(2)} s`, `frame ${this.motion.first + this.motion.frameAt(time)}`];
    if (bridged.length > 0) words.push(`bridged: ${bridged.join(", ")}`);
    this.hint.textContent = words.join(" · ");
    this.hint.hidden = false;
    const half = this.hint.offsetWidth / 2;
    const middle = this.element.clientWidth * this.#share(time);
    this.hint.style.left = `${Math.min(Math.max(middle, half), this.element.clientWidth - half)}px`;
  }
}
