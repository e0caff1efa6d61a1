/** Film the piece, so that the page stays usable: on the server, or else here, with a stage of its own. */

import { film, obstacle } from "motionmind/film";
import { movement } from "../movements.js";
import { perStudio } from "../shell/hooks.js";
import { Movements } from "../timeline/composed.js";
import { stageOf } from "../viewer.js";

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

  /** Film the piece from where the viewer looks, and offer the file. */
  async make() {
    const { studio } = this;
    if (this.share !== null) return undefined;
    if (!studio.viewer.isHome) studio.viewer.back();
    this.stopper = new AbortController();
    const { signal } = this.stopper;
    const progress = (/** @type {number} */ share) => this.#progress(share);
    progress(0);
    try {
      const { blob, name } = (await drawn(studio, progress, signal)) ?? (await recorded(studio, progress, signal));
      offer(blob, name);
      studio.say(`Film saved: ${name}.`);
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
 * Have the studio film the piece as MP4; null if it has no encoder. Later edits do not matter.
 * @param {any} studio @param {(share: number) => void} progress @param {AbortSignal} signal
 * @returns {Promise<{blob: Blob, name: string} | null>}
 */
async function drawn({ api, store, viewer }, progress, signal) {
  if (!viewer.stage) throw new Error("the piece has not loaded yet");
  const { job } = await api.post("/api/films", direction(viewer.stage));
  if (job === null) return null;
  await new Promise((done, failed) => {
    const look = () => {
      const { state, words, done: frames, of } = store.jobs.get(job) ?? {};
      if (of) progress(frames / of);
      if (signal.aborted) api.delete(`/api/jobs/${job}`).catch(() => {});
      else if (state === "failed" || state === "cancelled") failed(new Error(words));
      else if (state !== "done") return;
      store.removeEventListener("change", look);
      if (signal.aborted) failed(signal.reason);
      else done(null);
    };
    store.addEventListener("change", look);
    signal.addEventListener("abort", look);
    look();
  });
  const answer = await api.file(`/api/films/${job}`);
  return { blob: await answer.blob(), name: nameOf(answer) ?? "piece.mp4" };
}

/** Where a stage's camera stands, in degrees. @param {any} stage */
function direction({ camera, controls }) {
  const [x, y, z] = camera.position.clone().sub(controls.target).normalize().toArray();
  const degrees = 180 / Math.PI;
  return { azimuth: degrees * Math.atan2(x, z), elevation: degrees * Math.asin(Math.min(Math.max(y, 0), 1)) };
}

/**
 * Film the piece as WebM, in this browser: without ffmpeg the studio makes no MP4. Later edits do not matter.
 * @param {any} studio @param {(share: number) => void} progress @param {AbortSignal} signal
 * @returns {Promise<{blob: Blob, name: string}>}
 */
async function recorded({ api, store, viewer }, progress, signal) {
  const wrong = obstacle();
  if (wrong) throw new Error(wrong);
  const title = (store.state.title || "piece").replace(UNSAFE, "-").replace(/^[. ]+|[. ]+$/g, "") || "piece";
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
  /** @type {any} */
  let stage;
  try {
    const movements = new Movements((/** @type {string} */ key) => movement(api, key));
    const motion = await piece.copy(movements);
    await motion.load();
    signal.throwIfAborted();
    stage = stageOf(canvas, motion, () => {});
    stage.dark = viewer.theme.dark;
    stage.filming = false; // takes up the size
    stage.camera.position.copy(position);
    stage.controls.target.copy(target);
    stage.controls.update();
    stage.filming = true; // keeps it
    const told = (/** @type {number} */ time) => progress(time / Math.max(motion.end, 1e-9));
    return { blob: await film(stage, motion, ghosts, told, signal), name: `${title}.webm` };
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

/** The name under which an answer is to be saved. @param {Response} answer */
export function nameOf(answer) {
  const encoded = /filename\*=UTF-8''([^;]+)/.exec(answer.headers.get("Content-Disposition") ?? "")?.[1];
  return encoded && decodeURIComponent(encoded);
}
