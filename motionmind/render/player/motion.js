/** Movement on a skeleton: the frames that were stored, and the posture at any moment between them. */

export const MOMENT = 1e-6; // seconds: times that are no further apart are one

export class Motion {
  /** @param {object} data what README.md describes */
  constructor(data) {
    this.name = data.name;
    this.joints = data.skeleton.names;
    this.times = new Float64Array(decoded(data.times)); // seconds, increasing [T]
    this.root = new Float32Array(decoded(data.root)); // metres [T * 3]
    this.rotations = unpacked(new Uint32Array(decoded(data.rotations))); // x, y, z, w, local to the parent [T * J * 4]
    this.first = data.first; // the number of the first frame, where these are a part of something longer
    this.farthest = data.farthest; // frames in which the body reaches farthest in some direction
    this.sound = data.sound && decoded(data.sound); // a sound file, or undefined
    this.insertions = data.insertions; // {times [M + 1], bridged: [{joint, move}]}, from the earliest to the latest
  }

  get length() {
    return this.times.length;
  }

  get start() {
    return this.times[0];
  }

  get end() {
    return this.times[this.length - 1];
  }

  /** The last frame that is not after `time`; the first if all are. */
  frameAt(time) {
    let low = 0;
    let high = this.length;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time + MOMENT) low = middle;
      else high = middle;
    }
    return low;
  }

  /** Put the posture at `time` into `rotations` [J * 4] and `root` [3]: slerp between frames, the root linear. */
  sample(time, rotations, root) {
    const before = this.frameAt(time);
    const after = Math.min(before + 1, this.length - 1);
    const step = this.times[after] - this.times[before];
    const share = step > 0 ? Math.min(Math.max((time - this.times[before]) / step, 0), 1) : 0;
    for (let i = 0; i < 3; i++) {
      root[i] = this.root[before * 3 + i] * (1 - share) + this.root[after * 3 + i] * share;
    }
    const size = this.joints.length * 4;
    for (let i = 0; i < size; i += 4) slerp(rotations, i, this.rotations, before * size + i, after * size + i, share);
  }

  /** The insertion from whose A to whose B `time` is, or undefined. */
  insertionAt(time) {
    return this.insertions.find(({ times }) => times[0] - MOMENT <= time && time <= times.at(-1) + MOMENT);
  }

  /** When those of an insertion's A and B are that the frames hold. */
  ends({ times }) {
    return [times[0], times.at(-1)].filter((time) => this.start - MOMENT <= time && time <= this.end + MOMENT);
  }

  /** Whether the engine made the posture at `time`: it is between the A and the B of an insertion. */
  insertedAt(time) {
    return this.insertions.some(({ times }) => times[0] + MOMENT < time && time < times.at(-1) - MOMENT);
  }

  /** The joints that are, at `time`, amid a move that no corpus attests: their indices. */
  bridgedAt(time) {
    if (!this.insertedAt(time)) return [];
    const found = new Set();
    for (const { times, bridged } of this.insertions) {
      for (const { joint, move } of bridged) {
        if (times[move] - MOMENT < time && time < times[move + 1] + MOMENT) found.add(joint);
      }
    }
    return [...found];
  }
}

export function decoded(base64) {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
}

/** Quaternions of two words each, the low one first: the three coefficients that are smallest, 20 bits each. */
function unpacked(words) {
  const most = 2 ** 19 - 1;
  const out = new Float32Array(words.length * 2);
  for (let i = 0; i < words.length; i += 2) {
    const [low, high] = [words[i], words[i + 1]];
    const levels = [(high >>> 8) & 0xfffff, ((high & 0xff) << 12) | (low >>> 20), low & 0xfffff];
    const largest = high >>> 28;
    let rest = 1;
    for (let j = 0, k = 0; k < 4; k++) {
      if (k === largest) continue;
      const value = (levels[j++] / most - 1) * Math.SQRT1_2;
      out[i * 2 + k] = value;
      rest -= value * value;
    }
    out[i * 2 + largest] = Math.sqrt(rest);
  }
  return out;
}

/** Put the rotation a `share` of the way from `from[a..]` to `from[b..]`, the short way round, into `out[at..]`. */
export function slerp(out, at, from, a, b, share) {
  const cosine = from[a] * from[b] + from[a + 1] * from[b + 1] + from[a + 2] * from[b + 2] + from[a + 3] * from[b + 3];
  const angle = Math.acos(Math.min(Math.abs(cosine), 1));
  // Of a small angle a straight line is as good, and is divided by no sine.
  const [x, y] = angle < 1e-4 ? [1 - share, share] : [Math.sin((1 - share) * angle), Math.sin(share * angle)];
  const turn = cosine < 0 ? -y : y;
  let square = 0;
  for (let i = 0; i < 4; i++) {
    out[at + i] = x * from[a + i] + turn * from[b + i];
    square += out[at + i] ** 2;
  }
  for (let i = 0; i < 4; i++) out[at + i] /= Math.sqrt(square);
}
