/** The line of time in numbers: seconds to pixels, ticks, what is in sight. Nothing here knows a page. */

export const LEAST = 2; // pixels a second
export const MOST = 1200;
const APART = 64; // pixels between numbers on the ruler, at least
const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600];
const DIGIT = 8; // pixels of a digit there
const BAR = 8; // counts that dancers count to
const CROWD = 300; // stretches in sight, at most
const SIDES = 40; // pixels beside a piece that is shown whole: a posture that it ends with is drawn on both sides of its end

/** The scale that shows `seconds` in `width` pixels, as far as so many stretches can be told apart. */
export function fitting(seconds, width, stretches) {
  return bounded((width - SIDES) / Math.max(seconds, 1), seconds, width, stretches);
}

/** A scale within its bounds. */
export function bounded(scale, seconds, width, stretches) {
  const crowded = (stretches / CROWD) * (width / Math.max(seconds, 1));
  return Math.min(Math.max(scale, LEAST, Math.min(crowded, MOST)), MOST);
}

/** Ticks of seconds from `from` to `to`: [{at, label}], labels where there is room. */
export function secondTicks(from, to, scale) {
  const step = STEPS.find((each) => each * scale >= APART) ?? 3600;
  const ticks = [];
  for (let i = Math.max(Math.floor(from / step), 0); i * step <= to; i++) {
    ticks.push({ at: i * step, label: clock(i * step, step) });
  }
  return ticks;
}

/** Ticks of counts at so many beats a minute: [{at, label, strong}]; each eight begins with a strong one. */
export function countTicks(from, to, scale, tempo) {
  const beat = 60 / tempo;
  const digits = String(Math.floor(to / beat / BAR) + 1).length; // of the last eight's number
  const room = (each) => (each < BAR / 2 ? 26 : 40) + DIGIT * (digits - 1);
  const every = [1, 2, 4, 8, 16, 32, 64, 128].find((each) => each * beat * scale >= room(each)) ?? 256;
  const ticks = [];
  for (let i = Math.max(Math.floor(from / (beat * every)), 0) * every; i * beat <= to; i += every) {
    const eight = Math.floor(i / BAR) + 1;
    const count = (i % BAR) + 1;
    ticks.push({ at: i * beat, label: count === 1 ? `${eight}·1` : String(count), strong: count === 1 });
  }
  return ticks;
}

/** A time in words for the ruler. */
export function clock(seconds, step = 0.01) {
  const digits = step < 1 ? (step < 0.1 ? 2 : 1) : 0;
  const minutes = Math.floor((seconds + 1e-9) / 60);
  const rest = (seconds - minutes * 60).toFixed(digits);
  return minutes > 0 ? `${minutes}:${rest.padStart(digits ? digits + 3 : 2, "0")}` : `${rest}`;
}

/** The eight and the count in which a time is, in words. */
export function countAt(seconds, tempo) {
  const count = Math.floor((seconds * tempo) / 60 + 1e-6);
  return `eight ${Math.floor(count / BAR) + 1}, count ${(count % BAR) + 1}`;
}
