/** The sound of the piece's music, its wave form, and what is wrong with it. It knows no view. */

import { Sound } from "motionmind/sound";
import { perStudio } from "../shell/hooks.js";

const N_SAMPLES = 256; // of a peak
const SOUNDING = /\.(wav|flac|ogg|mp3)$/i; // other files have beats alone
const NOTHING = { path: "", begins: 0, beats: [], first: 0 };

/** The music of a studio. */
export const musicOf = perStudio((studio) => new Music(studio));

/** Fires "change" when the sound is decoded, fails, or is turned on or off. */
class Music extends EventTarget {
  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    this.path = "";
    /** @type {Sound | undefined} once it is decoded */
    this.sound = undefined;
    /** @type {Float32Array} the loudest of each few samples, and how many there are a second */
    this.peaks = new Float32Array(0);
    this.rate = 1;
    this.fault = "";
    studio.store.addEventListener("change", () => this.#follow());
    document.addEventListener("pointerup", () => this.sound?.wake()); // browsers let nothing sound before
    document.addEventListener("keydown", () => this.sound?.wake());
    this.#follow();
  }

  /** The music as the project has it. @returns {import("./beats.js").Music} */
  get kept() {
    return this.studio.store.state?.music ?? NOTHING;
  }

  /** Whether it sounds while the piece plays. */
  get audible() {
    return this.sound?.audible ?? false;
  }

  #follow() {
    const { path, begins } = this.kept;
    if (path !== this.path) this.#load(path);
    if (this.sound) this.sound.begins = begins;
  }

  /** @param {string} path */
  async #load(path) {
    this.path = path;
    this.sound?.end();
    this.sound = undefined;
    this.peaks = new Float32Array(0);
    this.fault = "";
    this.#changed();
    if (!SOUNDING.test(path)) return;
    /** @type {Sound | undefined} */
    let sound;
    try {
      const answer = await this.studio.api.file(`/api/music?of=${encodeURIComponent(path)}`);
      const { viewer } = this.studio;
      sound = new Sound(viewer.player, await answer.arrayBuffer(), () => viewer.isHome);
      await sound.ready;
    } catch (error) {
      sound?.end();
      if (path !== this.path) return;
      const undecoded = error instanceof DOMException;
      this.fault = undecoded ? `This browser cannot play ${nameOf(path)}.` : error instanceof Error ? error.message : String(error);
      this.#changed();
      return;
    }
    if (path !== this.path) {
      sound.end();
      return;
    }
    this.sound = sound;
    this.peaks = peaksOf(sound.buffer);
    this.rate = sound.buffer.sampleRate / N_SAMPLES;
    sound.begins = this.kept.begins;
    sound.addEventListener("change", () => this.#changed());
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event("change"));
  }
}

/** A file's name. @param {string} path */
export function nameOf(path) {
  return path.split(/[\\/]/).at(-1) ?? path;
}

/** The loudest of each few samples of all channels. @param {AudioBuffer} buffer */
function peaksOf(buffer) {
  const peaks = new Float32Array(Math.ceil(buffer.length / N_SAMPLES));
  for (let channel = 0; channel < buffer.numberOfChannels; channel++) {
    const samples = buffer.getChannelData(channel);
    for (let i = 0; i < samples.length; i++) {
      const [at, value] = [(i / N_SAMPLES) | 0, Math.abs(samples[i])];
      if (value > peaks[at]) peaks[at] = value;
    }
  }
  return peaks;
}
