/** Keep a video in step with the playhead: it seeks while nothing plays, and corrects its rate while something does. */

const SAME_S = 0.001;
const STEADY_S = 0.008; // a third of a frame at 40 frames a second: less is not corrected
const JUMP_S = 0.25; // more is not caught up by rate, but by seeking
const CATCH_UP_S = 0.4; // in which a drift is made up for, as far as the rate may change
const MAX_RATE_CHANGE_RATIO = 0.25;
const RATE_STEP_RATIO = 0.005; // smaller changes of the rate are left out: each costs the browser some work

export class Follow {
  #wanted = -1; // a seek that waits for the one under way

  /**
   * @param {HTMLVideoElement} video
   * @param {any} viewer
   */
  constructor(video, viewer) {
    this.video = video;
    this.viewer = viewer;
    this.begins = 0; // time of the video at the piece's start, seconds
    this.step = this.step.bind(this);
    this.seeked = this.seeked.bind(this);
    viewer.player.addEventListener("change", this.step);
    viewer.addEventListener("show", this.step);
    video.addEventListener("loadedmetadata", this.step);
    video.addEventListener("seeked", this.seeked);
  }

  /** Leave the video alone. */
  end() {
    this.viewer.player.removeEventListener("change", this.step);
    this.viewer.removeEventListener("show", this.step);
    this.video.removeEventListener("loadedmetadata", this.step);
    this.video.removeEventListener("seeked", this.seeked);
    this.video.pause();
  }

  /** The video's time for the moment in view, also where the video has none. */
  get due() {
    return this.viewer.player.time + this.begins;
  }

  /** Show the moment in view. */
  step() {
    const { video, viewer, due } = this;
    if (!(video.duration > 0) || !viewer.isHome || !video.checkVisibility()) {
      video.pause();
      return;
    }
    const { playing, speed } = viewer.player;
    if (!playing || due < 0 || due >= video.duration) {
      video.pause();
      this.#seek(Math.min(Math.max(due, 0), video.duration));
      return;
    }
    const drift = video.currentTime - due;
    if (video.paused) {
      this.#seek(due);
      video.play().catch(() => {}); // another step paused it
    } else if (Math.abs(drift) > JUMP_S) this.#seek(due);
    const change = Math.abs(drift) < STEADY_S || video.seeking ? 0 : -drift / CATCH_UP_S;
    const rate = speed * (1 + Math.min(Math.max(change, -MAX_RATE_CHANGE_RATIO), MAX_RATE_CHANGE_RATIO));
    if (Math.abs(rate - video.playbackRate) > RATE_STEP_RATIO * speed) video.playbackRate = rate;
  }

  seeked() {
    const wanted = this.#wanted;
    this.#wanted = -1;
    if (wanted >= 0) this.#seek(wanted);
  }

  /** @param {number} time */
  #seek(time) {
    const { video } = this;
    if (video.seeking) this.#wanted = time;
    else if (Math.abs(video.currentTime - time) > SAME_S) video.currentTime = time;
  }
}
