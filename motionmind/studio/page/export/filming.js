/** Film the piece, with a stage of its own so that the page stays usable. */

import { film, obstacle } from "motionmind/film";
import { Stage } from "motionmind/stage";
import { movement } from "../movements.js";
import { perStudio } from "../shell/hooks.js";
import { Composed, Movements } from "../timeline/composed.js";

const UNSAFE = /[\\/:*?"<>|\u0000-\u001f\u007f]+/g; // in file names, on some system
/** The films of a studio. */
export const filmingOf = perStudio((studio) => new Filming(studio));

/** Fires "change" when a film begins, progresses or ends. */
class Filming extends EventTarget {
  /** @param {any} studio */
  constructor(studio) {
    super();
    this.studio = studio;
    /** @type {number | null} share that is done; null if no film is in the making */
    this.share = null;
    this.stopper = new AbortController();
    addEventListener("beforeunload", (event) => this.share !== null && event.preventDefault()); // the browser asks
  }

  /** Film the piece from the viewer's camera, and offer the file. */
  async make() {
    const { studio } = this;
    const wrong = obstacle();
    if (wrong) return studio.say(wrong, { kind: "error" });
    if (this.share !== null) return undefined;
    if (!studio.viewer.isHome) studio.viewer.back();
    this.stopper = new AbortController();
    const { signal } = this.stopper;
    const title = (studio.store.state.title || "piece").replace(UNSAFE, "-").replace(/^[. ]+|[. ]+$/g, "") || "piece";
    this.#progress(0);
    try {
      const made = await filmed(studio, (share) => this.#progress(share), signal);
      offer(made, `${title}.webm`);
      studio.say(`Film saved: ${title}.webm.`);
    } catch (error) {
      if (!signal.aborted) studio.say(`The film failed: ${error instanceof Error ? error.message : error}`, { kind: "error" });
    }
    return this.#progress(null);
  }

  stop() {
    this.stopper.abort();
  }

  /** @param {number | null} share */
  #progress(share) {
    this.share = share;
    this.dispatchEvent(new Event("change"));
  }
}

/**
 * Film the piece as it is now; later edits do not matter.
 * @param {any} studio @param {(share: number) => void} progress @param {AbortSignal} signal
 * @returns {Promise<Blob>}
 */
async function filmed({ api, viewer }, progress, signal) {
  const { piece, stage: seen, ghosts } = viewer;
  if (!piece || !seen) throw new Error("the piece has not loaded yet");
  // Copy it now: while the movement loads, another panel may turn the camera.
  const [position, target] = [seen.camera.position.clone(), seen.controls.target.clone()];
  const { clientWidth, clientHeight } = seen.canvas;
  const canvas = document.createElement("canvas");
  const place = Object.assign(document.createElement("div"), { className: "filmed", ariaHidden: "true" });
  Object.assign(place.style, { width: `${clientWidth}px`, height: `${clientHeight}px` });
  place.append(canvas);
  document.body.append(place);
  /** @type {Stage | undefined} */
  let stage;
  try {
    const movements = new Movements((/** @type {string} */ key) => movement(api, key));
    await movements.load(piece.parts[0].key);
    const motion = /** @type {any} */ (new Composed(piece.parts, movements, piece.name));
    await motion.load();
    signal.throwIfAborted();
    stage = new Stage(canvas, motion, motion.body, motion.colours, () => {});
    stage.dark = viewer.theme.dark;
    stage.filming = false; // takes up the size
    stage.camera.position.copy(position);
    stage.controls.target.copy(target);
    stage.controls.update();
    stage.filming = true; // keeps it
    return await film(stage, motion, ghosts, (/** @type {number} */ time) => progress(time / Math.max(motion.end, 1e-9)), signal);
  } finally {
    stage?.controls.dispose();
    stage?.renderer.dispose();
    stage?.renderer.forceContextLoss();
    place.remove();
  }
}

/** Have the browser save a file. @param {Blob} blob @param {string} name */
export function offer(blob, name) {
  const link = document.createElement("a");
  Object.assign(link, { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
