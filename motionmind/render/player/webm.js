/**
 * WebM as browsers record it, written again with the times that its frames are meant to have.
 *
 * A recorder notes when frames reached it by the clock on the wall, and knows no length before the end. Here each frame
 * gets its time in the film, and the file its length and its key frames' places, so that it can be searched.
 * Source: RFC 8794 (EBML) and RFC 9559 (Matroska), [Lhomme20] and [Lhomme24].
 */

const ID = {
  header: [0x1a, 0x45, 0xdf, 0xa3],
  segment: [0x18, 0x53, 0x80, 0x67],
  info: [0x15, 0x49, 0xa9, 0x66],
  timestampScale: [0x2a, 0xd7, 0xb1],
  duration: [0x44, 0x89],
  muxer: [0x4d, 0x80],
  writer: [0x57, 0x41],
  tracks: [0x16, 0x54, 0xae, 0x6b],
  cues: [0x1c, 0x53, 0xbb, 0x6b],
  cue: [0xbb],
  cueTime: [0xb3],
  cuePlaces: [0xb7],
  cueTrack: [0xf7],
  cuePlace: [0xf1],
  cluster: [0x1f, 0x43, 0xb6, 0x75],
  timestamp: [0xe7],
  group: [0xa0],
  block: [0xa1],
  reference: [0xfb],
  simpleBlock: [0xa3],
};
const NAMES = new Map(Object.entries(ID).map(([name, bytes]) => [String(bytes), name]));
const NESTED = new Set(["segment", "cluster", "group"]);
const LONGEST = 30000; // milliseconds of a cluster, whose blocks count from its start with 16 bits
const KEY = 0x80; // the flag of a block that needs no other

/**
 * Give the frames of a recording their times in a film.
 * @param {Uint8Array} bytes what a MediaRecorder made of one track of pictures
 * @param {number[]} drawn when each frame was drawn, milliseconds by any clock
 * @param {number[]} times when each is shown in the film, seconds, increasing from 0
 * @param {number} length of the film, seconds
 * @returns {Uint8Array}
 */
export function retimed(bytes, drawn, times, length) {
  const { header, tracks, blocks } = read(bytes);
  if (blocks.length === 0) throw new Error("the recording has no frames");
  const shown = blocks.map(({ time }, i) => {
    // A recorder that cannot keep up leaves frames out; then the clock says which are there.
    const frame = blocks.length === times.length ? i : nearest(drawn, drawn[0] + time - blocks[0].time);
    return Math.round(1000 * times[frame]);
  });
  const info = element(
    ID.info,
    element(ID.timestampScale, number(1_000_000)), // nanoseconds
    element(ID.duration, float(1000 * length)),
    element(ID.muxer, text("MotionMind")),
    element(ID.writer, text("MotionMind")),
  );
  const clusters = clustered(blocks, shown);
  const start = info.length + tracks.length;
  // What the places are written with has always as many bytes, so that they may stand before what they are of.
  const room = cues(clusters, 0).length;
  return joined([header, element(ID.segment, info, tracks, cues(clusters, start + room), ...clusters.map(({ data }) => data))]);
}

/** How many frames a recording has so far. */
export function frameCount(bytes) {
  return read(bytes).blocks.length;
}

/** Find the header, the tracks and the frames: {time, in milliseconds; key; data with the track's number}. */
function read(bytes) {
  const found = { header: undefined, tracks: undefined, blocks: [] };
  let cluster = 0;
  let group; // the block of a group, which is a key frame if it refers to no other
  const walk = (at, end) => {
    while (at < end) {
      const id = vint(bytes, at);
      const size = vint(bytes, at + id.length);
      const from = at + id.length + size.length;
      const to = size.unknown ? end : Math.min(from + size.value, end); // all that follows is in a live segment
      const name = NAMES.get(String([...bytes.subarray(at, at + id.length)]));
      const block = (key) => {
        const time = cluster + new DataView(bytes.buffer, bytes.byteOffset + from + 1).getInt16(0);
        found.blocks.push({ time, key, track: bytes[from], data: bytes.subarray(from + 4, to) });
        return found.blocks.at(-1);
      };
      if (name === "header" || name === "tracks") found[name] = bytes.subarray(at, to);
      else if (name === "timestamp") cluster = bytes.subarray(from, to).reduce((value, byte) => 256 * value + byte, 0);
      else if (name === "simpleBlock") block((bytes[from + 3] & KEY) > 0);
      else if (name === "block") group = block(true);
      else if (name === "reference") group.key = false;
      else if (NESTED.has(name)) walk(from, to);
      at = to;
    }
  };
  walk(0, bytes.length);
  return found;
}

/** Put frames into clusters, a new one for each key frame: {time, data}. */
function clustered(blocks, times) {
  const clusters = [];
  blocks.forEach(({ key, track, data }, i) => {
    const last = clusters.at(-1);
    if (!last || key || times[i] - last.time > LONGEST) clusters.push({ time: times[i], key, track, blocks: [] });
    const { time, blocks } = clusters.at(-1);
    const since = times[i] - time;
    blocks.push(element(ID.simpleBlock, Uint8Array.of(track, since >> 8, since & 0xff, key ? KEY : 0), data));
  });
  return clusters.map(({ time, key, track, blocks }) => ({
    time,
    key,
    track: track & 0x7f,
    data: element(ID.cluster, element(ID.timestamp, number(time)), ...blocks),
  }));
}

/** Write where key frames are, when the first cluster is at `place` in the segment. */
function cues(clusters, place) {
  const found = [];
  for (const { time, key, track, data } of clusters) {
    const places = element(ID.cuePlaces, element(ID.cueTrack, number(track)), element(ID.cuePlace, number(place)));
    if (key) found.push(element(ID.cue, element(ID.cueTime, number(time)), places));
    place += data.length;
  }
  return element(ID.cues, ...found);
}

/** The number at a place, of as many bytes as its first one says; `unknown` if all its bits are set. */
function vint(bytes, at) {
  const length = Math.clz32(bytes[at]) - 23;
  let value = bytes[at] & (0xff >> length);
  let unknown = value === 0xff >> length;
  for (let i = 1; i < length; i++) {
    value = 256 * value + bytes[at + i];
    unknown &&= bytes[at + i] === 0xff;
  }
  return { value, length, unknown };
}

function element(id, ...parts) {
  const data = joined(parts);
  const size = number(data.length);
  size[0] = 0x01; // seven bytes follow
  return joined([Uint8Array.from(id), size, data]);
}

/** A whole number, in eight bytes. */
function number(value) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigUint64(0, BigInt(value));
  return bytes;
}

function float(value) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setFloat64(0, value);
  return bytes;
}

function text(words) {
  return new TextEncoder().encode(words);
}

function joined(parts) {
  const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}

/** The index of the value, of increasing ones, that is nearest to another. */
function nearest(values, value) {
  const after = values.findIndex((other) => other >= value);
  if (after <= 0) return after < 0 ? values.length - 1 : 0;
  return values[after] - value < value - values[after - 1] ? after : after - 1;
}
