/** The music's lane on the time line: its wave form and beats, which a drag shifts against the piece. */

import { html, useLayoutEffect, useReducer, useRef } from "../vendor/htm-preact-standalone.js";
import { MOST_S, useShift } from "../reference/shift.js";
import { useChange } from "../shell/hooks.js";
import { icon } from "../shell/icons.js";
import { useStore } from "../store.js";
import { countOf, timeOf } from "./beats.js";
import { musicOf, nameOf } from "./music.js";

const LEAD_PX = 16; // of the tracks before the piece, as in timeline.css
const KEY_STEP_S = 0.01;
const MIN_BEAT_PX = 4; // closer beats are left out
const BEAT_SHARE = 0.35; // of the height; the first of a phrase has all of it

/** @param {{does: any, sight: any, meter: import("./beats.js").Meter}} props */
export function MusicLane({ does, sight, meter }) {
  const { studio } = does;
  const kept = useStore(studio, ({ state }) => state?.music);
  return kept?.path ? html`<${Lane} key=${kept.path} does=${does} kept=${kept} sight=${sight} meter=${meter} />` : null;
}

/** @param {any} props */
function Lane({ does, kept, sight, meter }) {
  const { studio } = does;
  const music = musicOf(studio);
  const peaks = useChange(music, () => music.peaks);
  const fault = useChange(music, () => music.fault);
  const canvas = useRef(/** @type {any} */ (null));
  const [painted, repaint] = useReducer((/** @type {number} */ count) => count + 1, 0);
  // The time of the piece at which the music begins.
  const { now, handlers } = useShift({
    value: -kept.begins,
    digits: 4,
    step: KEY_STEP_S,
    perPixel: () => 1 / does.sight.scale,
    set: (seconds) => studio.act(() => studio.api.edit({ edit: "music", ...music.kept, begins: -seconds })),
  });
  useLayoutEffect(() => {
    const { theme } = studio.viewer;
    theme.addEventListener("change", repaint);
    return () => theme.removeEventListener("change", repaint);
  }, []);
  useLayoutEffect(() => {
    const left = (sight.left - LEAD_PX) / sight.scale;
    const pen = begin(canvas.current, sight.width);
    drawWave(pen, { left, begins: now, scale: sight.scale, peaks, rate: music.rate });
    if (kept.beats.length > 1) {
      const [first, last] = [kept.beats[0], kept.beats.length > 2 ? kept.beats.at(-1) : Infinity];
      const own = peaks.length ? [0, peaks.length / music.rate] : [first, last];
      drawBeats(pen, { left, scale: sight.scale, meter, moved: now + kept.begins, within: own.map((time) => time + now) });
    }
  }, [sight.left, sight.scale, sight.width, now, kept, meter, peaks, painted]);
  const words = fault || (kept.beats.length > 1 ? nameOf(kept.path) : `${nameOf(kept.path)}: no beats are known. Tap them (J) while it plays.`);
  return html`<div class="track music" data-testid="music-lane" data-beats=${kept.beats.length}>
    <canvas ref=${canvas} aria-hidden="true" style=${{ left: `${sight.left - LEAD_PX}px`, width: `${sight.width}px` }}></canvas>
    <div
      class="shift"
      role="slider"
      tabindex="0"
      data-testid="music-shift"
      aria-label="Shift the music"
      aria-valuemin=${-MOST_S}
      aria-valuemax=${MOST_S}
      aria-valuenow=${now}
      aria-valuetext=${`the music begins at ${now.toFixed(2)} s of the piece`}
      title="Drag sideways to shift the music (arrow keys)"
      ...${handlers}
    ></div>
    <p class=${fault ? "name fault" : "name"} role=${fault ? "alert" : undefined} data-testid="music-name" style=${{ left: `${sight.left - LEAD_PX}px` }}>
      ${fault && icon("warning")}<span>${words}</span>
    </p>
  </div>`;
}

/** Size a canvas, and return its pen, in pixels of the page. @param {HTMLCanvasElement} canvas @param {number} width */
function begin(canvas, width) {
  const height = canvas.clientHeight;
  const ratio = devicePixelRatio;
  Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.scale(ratio, ratio);
  const { color, borderTopColor, borderBottomColor } = getComputedStyle(canvas);
  return { pen, width, height, colours: { wave: color, beat: borderTopColor, strong: borderBottomColor } };
}

/** @param {any} on @param {{left: number, begins: number, scale: number, peaks: Float32Array, rate: number}} what */
function drawWave({ pen, width, height, colours }, { left, begins, scale, peaks, rate }) {
  const loudest = peaks.reduce((most, one) => Math.max(most, one), 1e-6);
  const at = (/** @type {number} */ x) => Math.floor((left + x / scale - begins) * rate);
  pen.fillStyle = colours.wave;
  for (let x = 0; x < width; x++) {
    let peak = 0;
    const end = Math.min(Math.max(at(x + 1), at(x) + 1), peaks.length);
    for (let i = Math.max(at(x), 0); i < end; i++) peak = Math.max(peak, peaks[i]);
    const tall = (peak / loudest) * height;
    pen.fillRect(x, (height - tall) / 2, 1, tall);
  }
}

/** @param {any} on @param {{left: number, scale: number, meter: import("./beats.js").Meter, moved: number, within: number[]}} what */
function drawBeats({ pen, width, height, colours }, { left, scale, meter, moved, within }) {
  const { counts, tempo } = meter;
  const every = [1, counts].find((each) => ((60 * each) / tempo) * scale >= MIN_BEAT_PX);
  if (!every) return;
  const [from, to] = [Math.max(left, within[0]) - moved, Math.min(left + width / scale, within[1]) - moved];
  for (let i = Math.ceil(countOf(from, meter) / every - 1e-6) * every, time; (time = timeOf(i, meter)) <= to + 1e-6; i += every) {
    const strong = i % counts === 0;
    pen.fillStyle = strong ? colours.strong : colours.beat;
    const tall = strong ? height : BEAT_SHARE * height;
    pen.fillRect((time + moved - left) * scale - 0.5, height - tall, strong ? 2 : 1, tall);
  }
}
