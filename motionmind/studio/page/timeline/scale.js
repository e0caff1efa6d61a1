/** The time line's scale and ticks. Nothing here knows a view. */

const [MIN_SCALE, MAX_SCALE] = [2, 1200]; // pixels a second
const MIN_LABEL_DISTANCE_PX = 64;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600];
const DIGIT_PX = 8;
const COUNTS = 8; // dancers count eights
const MAX_VISIBLE = 300; // stretches
const MARGIN_PX = 40; // of a piece shown whole: a posture at its end extends beyond it

/** The scale that fits `seconds` into `width` pixels, unless the stretches would be too crowded. */
export function fitting(seconds, width, stretches) {
  return bounded((width - MARGIN_PX) / Math.max(seconds, 1), seconds, width, stretches);
}

/** Clamp a scale to its bounds. */
export function bounded(scale, seconds, width, stretches) {
  const crowded = (stretches / MAX_VISIBLE) * (width / Math.max(seconds, 1));
  return Math.min(Math.max(scale, MIN_SCALE, Math.min(crowded, MAX_SCALE)), MAX_SCALE);
}

/** Ticks of seconds from `from` to `to`: [{at, label}], labels where there is room. */
export function secondTicks(from, to, scale) {
  const step = STEPS_S.find((each) => each * scale >= MIN_LABEL_DISTANCE_PX) ?? 3600;
  const ticks = [];
  for (let i = Math.max(Math.floor(from / step), 0); i * step <= to; i++) {
    ticks.push({ at: i * step, label: clock(i * step, step) });
  }
  return ticks;
}

/** Ticks of counts at so many beats a minute: [{at, label, strong}]; each eight begins with a strong one. */
export function countTicks(from, to, scale, tempo) {
  const beat = 60 / tempo;
  const digits = String(Math.floor(to / beat / COUNTS) + 1).length; // of the last eight
  const room = (each) => (each < COUNTS / 2 ? 26 : 40) + DIGIT_PX * (digits - 1);
  const every = [1, 2, 4, 8, 16, 32, 64, 128].find((each) => each * beat * scale >= room(each)) ?? 256;
  const ticks = [];
  for (let i = Math.max(Math.floor(from / (beat * every)), 0) * every; i * beat <= to; i += every) {
    const eight = Math.floor(i / COUNTS) + 1;
    const count = (i % COUNTS) + 1;
    ticks.push({ at: i * beat, label: count === 1 ? `${eight}·1` : String(count), strong: count === 1 });
  }
  return ticks;
}

/** A time as a label. */
export function clock(seconds, step = 0.01) {
  const digits = step < 1 ? (step < 0.1 ? 2 : 1) : 0;
  const minutes = Math.floor((seconds + 1e-9) / 60);
  const rest = (seconds - minutes * 60).toFixed(digits);
  return minutes > 0 ? `${minutes}:${rest.padStart(digits ? digits + 3 : 2, "0")}` : `${rest}`;
}

/** The eight and the count at a time, in words. */
export function countAt(seconds, tempo) {
  const count = Math.floor((seconds * tempo) / 60 + 1e-6);
  return `eight ${Math.floor(count / COUNTS) + 1}, count ${(count % COUNTS) + 1}`;
}
