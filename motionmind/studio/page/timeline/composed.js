/** A piece as a motion: parts that the server placed, of movements that load on demand. */

import { MOMENT, slerp } from "motionmind/motion";

/**
 * @typedef {{key: string, first: number, last: number, at: number, seconds: number, place: [number, number],
 *   turn: number, inserted: boolean}} Part
 */

/** A cache of loaded movements by key. */
export class Movements {
  /** @param {(key: string) => Promise<any>} fetch a movement: the player's Motion, with its `body` and `colours` */
  constructor(fetch) {
    this.fetch = fetch;
    /** @type {Map<string, any>} */
    this.here = new Map();
  }

  /** The movement, if it has loaded. @param {string} key */
  at(key) {
    return this.here.get(key);
  }

  /** @param {string} key */
  async load(key) {
    const known = this.here.get(key);
    if (known) return known;
    const motion = await this.fetch(key);
    this.here.set(key, motion);
    return motion;
  }

  /** Forget all movements but these. @param {Iterable<string>} keys */
  keep(keys) {
    const wanted = new Set(keys);
    for (const key of this.here.keys()) if (!wanted.has(key)) this.here.delete(key);
  }
}

/** A piece with the interface of the player's Motion. Until a movement has loaded, the body holds the posture before it. */
export class Composed {
  /**
   * @param {Part[]} parts in order, at least one; the movement of the first has loaded
   * @param {Movements} movements
   * @param {string} name
   */
  constructor(parts, movements, name) {
    this.parts = parts;
    this.movements = movements;
    this.name = name;
    this.first = 0;
    const { joints, body, colours } = movements.at(parts[0].key);
    Object.assign(this, { body, colours });
    /** @type {string[]} */
    this.joints = joints;
    this.times = new Float64Array();
    /** @type {number[]} start time of each part */
    this.starts = [];
    /** @type {{times: number[], bridged: {joint: number, move: number}[]}[]} */
    this.insertions = [];
    /** @type {number[]} */
    this.farthest = [];
    this.#updateTimes();
    const size = joints.length * 4;
    const both = new Float64Array(2 * size);
    this.beside = { both, from: both.subarray(0, size), to: both.subarray(size) };
  }

  get length() {
    return this.times.length;
  }

  get start() {
    return 0;
  }

  get end() {
    return this.times[this.length - 1];
  }

  /** The keys of its movements. */
  get keys() {
    return this.parts.map(({ key }) => key);
  }

  /** A copy, once its first movement has loaded. @param {Movements} movements where it loads them */
  async copy(movements) {
    await movements.load(this.parts[0].key);
    return new Composed(this.parts, movements, this.name);
  }

  /** The mirrored piece, once its first movement has loaded. */
  async mirrored() {
    const parts = this.parts.map((part) => ({
      ...part,
      key: part.key.startsWith("~") ? part.key.slice(1) : `~${part.key}`,
      place: /** @type {[number, number]} */ ([-part.place[0], part.place[1]]),
      turn: -part.turn,
    }));
    await this.movements.load(parts[0].key);
    return new Composed(parts, this.movements, this.name);
  }

  /** Load the movements of all parts in order. */
  async load() {
    const keys = [...new Set(this.parts.map(({ key }) => key))];
    for (let i = 0; i < keys.length; i += 8) {
      await Promise.allSettled(keys.slice(i, i + 8).map((key) => this.movements.load(key)));
    }
    this.#updateTimes();
  }

  /** Compute the times of frames and insertions; frames of missing movements are evenly spaced. */
  #updateTimes() {
    const times = [];
    this.starts = this.parts.map(({ at }) => at);
    this.insertions = [];
    for (const part of this.parts) {
      const motion = this.movements.at(part.key);
      const [begin, speed] = motion ? [motion.times[part.first], speedOf(part, motion)] : [0, 1];
      const steps = Math.max(part.last - part.first, 1);
      for (let frame = part.first; frame <= part.last; frame++) {
        times.push(motion ? part.at + (motion.times[frame] - begin) / speed : part.at + (part.seconds * (frame - part.first)) / steps);
      }
      if (part.first === part.last && part.seconds > 0) times.push(part.at + part.seconds); // the end of a held posture
      if (!part.inserted) continue;
      const marks = motion?.insertions.length ? motion.insertions : [{ times: [0, part.seconds], bridged: [] }];
      const own = motion?.insertions.length ? part.at - begin : part.at;
      for (const mark of marks) this.insertions.push({ ...mark, times: mark.times.map((time) => time + own) });
    }
    this.times = Float64Array.from(times);
  }

  /** The last part that begins no later than `time`; the first if none does. @param {number} time */
  partAt(time) {
    return lastBefore(this.starts, time);
  }

  /** The last frame that is not after `time`; the first if all are. @param {number} time */
  frameAt(time) {
    return lastBefore(this.times, time);
  }

  /** Write the posture at `time` into `rotations` [J * 4] and `root` [3]. */
  sample(time, rotations, root) {
    const index = this.partAt(time);
    const part = this.#loadedAt(index);
    const next = this.parts[index + 1];
    const over = time - part.at - part.seconds;
    if (over <= MOMENT || !next || !this.movements.at(next.key)) {
      this.#sampleWithin(part, time, rotations, root);
      return;
    }
    // Between two parts without an insertion: interpolate.
    const { both, from, to } = this.beside;
    this.#sampleWithin(part, part.at + part.seconds, from, root);
    const [x, y, z] = root;
    this.#sampleWithin(next, next.at, to, root);
    const share = Math.min(over / (next.at - part.at - part.seconds), 1);
    [x, y, z].forEach((begin, i) => (root[i] = begin * (1 - share) + root[i] * share));
    for (let i = 0; i < from.length; i += 4) slerp(rotations, i, both, i, from.length + i, share);
  }

  /** The part at `index`, or the nearest earlier one whose movement has loaded. @param {number} index */
  #loadedAt(index) {
    while (index > 0 && !this.movements.at(this.parts[index].key)) index--;
    return this.parts[index];
  }

  #sampleWithin(part, time, rotations, root) {
    const motion = this.movements.at(part.key);
    const begin = motion.times[part.first];
    const own = Math.min(begin + Math.max(time - part.at, 0) * speedOf(part, motion), motion.times[part.last]);
    motion.sample(own, rotations, root);
    place(part, rotations, root);
  }

  /** The movement and the frame nearest to `time`. */
  placeAt(time) {
    const part = this.parts[this.partAt(time)];
    const { key, first, last, at } = part;
    const motion = this.movements.at(key);
    if (!motion) return null;
    const { times } = motion;
    const wanted = times[first] + (time - at) * speedOf(part, motion);
    const frame = lastBefore(times, wanted);
    const nearer = frame < last && times[frame + 1] - wanted < wanted - times[frame] ? frame + 1 : frame;
    return { key, frame: Math.min(nearer, last) };
  }

  /** The insertion at `time`, from A to B, or undefined. */
  insertionAt(time) {
    const index = lastBefore(this.insertions, time, ({ times }) => times[0]);
    const mark = this.insertions[index];
    return mark && mark.times[0] - MOMENT <= time && time <= lastOf(mark.times) + MOMENT ? mark : undefined;
  }

  /** The times of an insertion's A and B. */
  ends({ times }) {
    return [times[0], times.at(-1)];
  }

  /** Whether the engine made the posture at `time`. */
  insertedAt(time) {
    const times = this.insertionAt(time)?.times;
    return times !== undefined && times[0] + MOMENT < time && time < lastOf(times) - MOMENT;
  }

  /** The joints in a bridged move at `time`. */
  bridgedAt(time) {
    const mark = this.insertedAt(time) && this.insertionAt(time);
    if (!mark) return [];
    const { times, bridged } = mark;
    const now = bridged.filter(({ move }) => times[move] - MOMENT < time && time < times[move + 1] + MOMENT);
    return [...new Set(now.map(({ joint }) => joint))];
  }
}

/** How many times as fast as its movement a part plays; 1 for a single frame. @param {Part} part @param {any} motion */
function speedOf({ first, last, seconds }, { times }) {
  return seconds > 0 && last > first ? (times[last] - times[first]) / seconds : 1;
}

/** Turn a posture about the vertical and move it over the floor, as its part says. */
function place({ turn, place: [dx, dz] }, rotations, root) {
  const [sine, cosine] = [Math.sin(turn), Math.cos(turn)];
  const [x, z] = [root[0], root[2]];
  root[0] = x * cosine + z * sine + dx;
  root[2] = z * cosine - x * sine + dz;
  const [sy, cy] = [Math.sin(turn / 2), Math.cos(turn / 2)];
  const [qx, qy, qz, qw] = rotations;
  rotations[0] = cy * qx + sy * qz;
  rotations[1] = cy * qy + sy * qw;
  rotations[2] = cy * qz - sy * qx;
  rotations[3] = cy * qw - sy * qy;
}

function lastOf(times) {
  return times[times.length - 1];
}

/** The index of the last of ordered `values` not after `time`; 0 if there is none. */
export function lastBefore(values, time, of = (value) => value) {
  let low = 0;
  let high = values.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (of(values[middle]) <= time + MOMENT) low = middle;
    else high = middle;
  }
  return low;
}
