/** The clock: which moment of a motion is shown, and whether time goes on. It knows no page. */

/** Fires "change" whenever `time`, `playing`, `speed` or `loop` has changed. */
export class Player extends EventTarget {
  #speed = 1;
  #loop = true;

  /** @param {Motion} motion */
  constructor(motion) {
    super();
    this.motion = motion;
    this.time = motion.start; // seconds
    this.playing = false;
  }

  /** The frame that is shown, or was last. */
  get frame() {
    return this.motion.frameAt(this.time);
  }

  /** Seconds of the motion that go by in a second. */
  get speed() {
    return this.#speed;
  }

  set speed(value) {
    this.#speed = value;
    this.#changed();
  }

  /** Whether the start follows the end. */
  get loop() {
    return this.#loop;
  }

  set loop(value) {
    this.#loop = value;
    this.#changed();
  }

  /** Let time go on; from the start, if it is at the end. */
  play() {
    if (this.motion.length < 2) return;
    if (this.time >= this.motion.end) this.time = this.motion.start;
    this.playing = true;
    this.#changed();
  }

  pause() {
    this.playing = false;
    this.#changed();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Show the moment `time`, or the end of the motion that is nearer. */
  seek(time) {
    this.time = Math.min(Math.max(time, this.motion.start), this.motion.end);
    this.#changed();
  }

  /** Pause, and show the frame `by` frames on; between two frames, -1 is the one before. */
  step(by) {
    this.playing = false;
    const between = this.time > this.motion.times[this.frame] + 1e-6;
    const frame = this.frame + by + (between && by < 0 ? 1 : 0);
    this.seek(this.motion.times[Math.min(Math.max(frame, 0), this.motion.length - 1)]);
  }

  /** Let `seconds` of the viewer's time go by. */
  advance(seconds) {
    if (!this.playing) return;
    const { start, end } = this.motion;
    const time = this.time + seconds * this.speed;
    if (time < end) this.time = time;
    else if (this.loop && end > start) this.time = start + ((time - start) % (end - start));
    else [this.time, this.playing] = [end, false];
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event("change"));
  }
}
