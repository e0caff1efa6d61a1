/** Films: the whole movement as it is seen, drawn frame by frame and recorded by the browser as WebM. */

import { frameCount, retimed } from "motionmind/webm";

const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8"];
const RATE = 30; // frames a second
const LONGEST = 1280; // pixels, of a picture's longer side
const BITS = 8_000_000; // a second
const LAST = 300; // milliseconds that a recorder has for the last frame,
const LATEST = 3000; // and that it has on a machine so busy that frames are still missing

/** Say why this browser makes no films; undefined if it does. */
export function obstacle() {
  if (HTMLCanvasElement.prototype.captureStream && window.MediaRecorder && type()) return undefined;
  return (
    "This browser records no WebM, so it cannot film the movement. Open the page in Chromium, Chrome, Edge or Firefox, or " +
    "make a film by “motionmind render” with -o film.mp4 or film.gif."
  );
}

/**
 * Film a motion: from its first posture to its last, at its own speed, from where the camera is.
 * @param {Stage} stage
 * @param {Motion} motion
 * @param {object} ghosts as for `stage.show`
 * @param {function} onFrame called with the time of each frame when it is drawn
 * @param {AbortSignal} signal ends it, and throws
 * @returns {Promise<Blob>}
 */
export async function film(stage, motion, ghosts, onFrame, signal) {
  const times = frameTimes(motion);
  const pen = paper(stage.canvas).getContext("2d", { alpha: false }); // what shows through would be recorded beside it
  const recorder = new MediaRecorder(pen.canvas.captureStream(), { mimeType: type(), videoBitsPerSecond: BITS });
  const chunks = [];
  const recorded = new Promise((done, failed) => {
    recorder.addEventListener("dataavailable", ({ data }) => chunks.push(data));
    recorder.addEventListener("stop", done);
    recorder.addEventListener("error", ({ error }) => failed(error));
  });
  const drawn = [];
  recorder.start();
  try {
    for (const time of times) {
      await pause(1000 / RATE, drawn.at(-1));
      signal.throwIfAborted();
      stage.shoot(pen, time, ghosts);
      drawn.push(performance.now());
      onFrame(time);
    }
    do {
      await pause(LAST, performance.now());
      signal.throwIfAborted();
      await flushed(recorder);
    } while (frameCount(await joined(chunks)) < times.length && performance.now() - drawn.at(-1) < LATEST);
  } finally {
    if (recorder.state !== "inactive") recorder.stop();
  }
  await recorded;
  const shown = times.map((time) => time - motion.start);
  return new Blob([retimed(await joined(chunks), drawn, shown, motion.end - motion.start)], { type: "video/webm" });
}

function type() {
  return TYPES.find((one) => MediaRecorder.isTypeSupported(one));
}

/** Have a recorder hand out what it holds. */
function flushed(recorder) {
  const handed = new Promise((done) => recorder.addEventListener("dataavailable", done, { once: true }));
  recorder.requestData();
  return handed;
}

async function joined(chunks) {
  return new Uint8Array(await new Blob(chunks).arrayBuffer());
}

/** Even times from the first posture to the last, both included. */
function frameTimes({ start, end }) {
  const steps = Math.max(Math.floor((end - start) * RATE + 1e-3), 1);
  return Array.from({ length: steps + 1 }, (_, i) => start + ((end - start) * i) / steps);
}

/** A canvas of the shape of another, with even sides, as encoders like them. */
function paper({ clientWidth, clientHeight }) {
  const scale = LONGEST / Math.max(clientWidth, clientHeight);
  const even = (length) => Math.max(2 * Math.round((scale * length) / 2), 2);
  return Object.assign(document.createElement("canvas"), { width: even(clientWidth), height: even(clientHeight) });
}

/** Wait for the browser's next picture, at least `least` milliseconds after the moment `since`. */
async function pause(least, since = -Infinity) {
  do await new Promise(requestAnimationFrame);
  while (performance.now() - since < least - 1);
}
