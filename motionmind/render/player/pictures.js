/** When pictures are drawn: one after another while time goes on, one when something has changed, none while all rests. */

const LONGEST = 0.25; // seconds between pictures; a page that was hidden goes on where it was

export class Pictures {
  #asked = false;
  #since = 0; // the time of the request
  /** @type {number | undefined} when the picture before was drawn, if another was to follow at once */
  #last;

  /**
   * @param {Player} player goes on by the time from one picture to the next; whenever it changes, another is drawn
   * @param {() => void} draw
   */
  constructor(player, draw) {
    this.player = player;
    this.draw = draw;
    /** Milliseconds from the request for the picture until it is drawn. */
    this.late = 0;
    player.addEventListener("change", () => this.ask());
  }

  /** Have another picture drawn. */
  ask() {
    if (this.#asked) return;
    this.#asked = true;
    this.#since = performance.now();
    this.#last ??= performance.now(); // after a rest, time starts now
    requestAnimationFrame((now) => this.#next(now));
  }

  /** @param {number} now */
  #next(now) {
    const { player } = this;
    player.advance(Math.min(Math.max((now - /** @type {number} */ (this.#last)) / 1000, 0), LONGEST));
    this.#asked = false; // what changes by going on is in this picture
    this.#last = player.playing ? now : undefined;
    this.late = performance.now() - this.#since;
    this.draw();
    if (player.playing) this.ask();
  }
}
