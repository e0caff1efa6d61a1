/** Sound in step with a player: it follows the play head, at its speed and from loop to loop. It knows no page. */

const APART = 0.025; // seconds that the sound may be off the play head: less than a frame at 30 a second
const JUMP = 0.1; // seconds: a play head that is farther away has jumped, and is followed at once
const PATIENCE = 0.5; // seconds from one small correction to the next, so that a slow computer does not stutter
const FADE = 0.004; // seconds in which sound starts and stops, against clicks

/** Fires "change" whenever `audible` has changed. */
export class Sound extends EventTarget {
  #buffer;
  #playing; // {source, gain, at, offset, speed}: `offset` seconds of the sound were at `at` of the context's clock
  #corrected = 0;
  #muted = false;
  #ended = new AbortController();

  /**
   * @param {Player} player
   * @param {ArrayBuffer} file a sound file
   * @param {() => boolean} shown whether the player shows the movement that the sound belongs to
   */
  constructor(player, file, shown = () => true) {
    super();
    this.player = player;
    this.shown = shown;
    this.begins = 0; // the sound's time when the movement begins, seconds; less than 0 if it begins later
    this.context = new AudioContext();
    this.output = new GainNode(this.context);
    this.output.connect(this.context.destination);
    this.ready = this.context.decodeAudioData(file).then((buffer) => {
      this.#buffer = buffer;
      this.#follow();
    });
    const { signal } = this.#ended;
    player.addEventListener("change", () => this.#follow(), { signal });
    this.context.addEventListener("statechange", () => this.#changed(), { signal });
    document.addEventListener("visibilitychange", () => document.hidden && this.#stop(), { signal }); // no pictures follow then
  }

  /** Fall silent for good. */
  end() {
    this.#ended.abort();
    this.#stop();
    this.context.close();
  }

  /** The decoded sound, once it is ready. */
  get buffer() {
    return this.#buffer;
  }

  /** Whether sound comes while the movement plays: browsers wait for a click or a key. */
  get audible() {
    return !this.#muted && this.context.state === "running";
  }

  /** Let sound come, after a click or a key; unless it was turned off. */
  wake() {
    if (this.context.state !== "running") this.context.resume();
  }

  toggle() {
    this.#muted = this.audible;
    this.wake();
    this.#changed();
  }

  /** The moment of the movement that is heard now, seconds; undefined in silence. */
  get heard() {
    if (!this.#playing) return undefined;
    const { at, offset, speed } = this.#playing;
    return this.player.motion.start - this.begins + offset + (this.context.currentTime - this.#latency - at) * speed;
  }

  get #latency() {
    return this.context.outputLatency || 0;
  }

  #changed() {
    this.#follow();
    this.dispatchEvent(new Event("change"));
  }

  #follow() {
    const { player } = this;
    if (!player.playing || !this.audible || !this.#buffer || document.hidden || !this.shown()) {
      this.#stop();
      return;
    }
    const off = this.#playing?.speed === player.speed ? Math.abs(this.heard - player.time) : Infinity;
    if (off < APART || (off < JUMP && this.context.currentTime < this.#corrected + PATIENCE)) return;
    this.#stop();
    this.#start(player.time - player.motion.start + this.begins + this.#latency * player.speed, player.speed);
  }

  #start(offset, speed) {
    const at = (this.#corrected = this.context.currentTime);
    const gain = new GainNode(this.context, { gain: 0 });
    gain.gain.linearRampToValueAtTime(1, at + FADE);
    const source = new AudioBufferSourceNode(this.context, { buffer: this.#buffer, playbackRate: speed });
    source.connect(gain).connect(this.output);
    source.start(at + Math.max(-offset, 0) / speed, Math.min(Math.max(offset, 0), this.#buffer.duration));
    this.#playing = { source, gain, at, offset, speed };
  }

  #stop() {
    if (!this.#playing) return;
    const { source, gain } = this.#playing;
    const now = this.context.currentTime;
    gain.gain.cancelScheduledValues(now);
    gain.gain.setValueAtTime(gain.gain.value, now);
    gain.gain.linearRampToValueAtTime(0, now + FADE);
    source.stop(now + FADE);
    this.#playing = undefined;
  }
}
