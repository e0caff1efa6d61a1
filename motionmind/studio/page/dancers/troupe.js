/** All dancers of the piece as one motion, which the viewer plays on a stage of several bodies. */

import { Ensemble } from "motionmind/group";

/**
 * @typedef {{id: string, name: string, colour: number[], place: number[], facing: number, entry: number, end: number,
 *   mirrored: boolean, source: string, ways: number[][]}} Member
 * @typedef {{dancers: Member[], paints: object[], frames: number, rate: number, seconds: number}} Data
 *   the answer of GET /api/ensemble
 */

/** The dancers, with the interface of a piece: `own` and `clock` lead to the piece's time and back. */
export class Troupe extends Ensemble {
  /**
   * @param {any} piece a Composed whose first movement has loaded
   * @param {Data} data
   * @param {Map<string, any>} others movements of the dancers' own, and the mirrored piece, as `playedBy` names them
   */
  constructor(piece, data, others) {
    const names = [...new Set(data.dancers.map(playedBy))];
    const pieces = names.map((name) => rooted(name ? others.get(name) : piece));
    const dancers = data.dancers.map((one) => ({ ...one, piece: names.indexOf(playedBy(one)) }));
    super({ ...data, name: piece.name, dancers }, pieces, pieces.map(({ body }) => body));
    this.piece = piece;
    this.data = data;
    this.others = others;
    this.parts = piece.parts;
    /** The viewer embodies new colours anew. */
    this.colours = { ...piece.colours, dancers: data.paints };
    this.leader = this.dancers.find((/** @type {any} */ { source }) => !source);
  }

  /** Load all movements. */
  async load() {
    const whole = [this.piece, ...this.others.values()].filter((one) => one.load);
    await Promise.all(whole.map((one) => one.load()));
  }

  /** The keys of all movements. */
  get keys() {
    const own = [...this.others.values()].flatMap((one) => one.keys ?? one.key);
    return [...this.piece.keys, ...own];
  }

  /** The piece's time at a time of all, as its first dancer dances it. @param {number} time */
  own(time) {
    return this.leader ? this.leader.own(time) : time;
  }

  /** When the first dancer dances a time of the piece. @param {number} time */
  clock(time) {
    return this.leader ? this.leader.clock(time) : time;
  }

  /** The movement and the frame at a time. @param {number} time */
  placeAt(time) {
    return this.leader ? this.piece.placeAt(this.own(time)) : null;
  }

  /** A copy with movements of its own. @param {any} movements where it loads them */
  async copy(movements) {
    return gather(await this.piece.copy(movements), this.data);
  }
}

/** What a dancer dances: "" for the piece, "~" for the mirrored one, or the key of a movement. @param {Member} member */
function playedBy({ source, mirrored }) {
  return (mirrored ? "~" : "") + source;
}

/** All dancers of a piece, once the first movements have loaded. @param {any} piece a Composed @param {Data} data */
export async function gather(piece, data) {
  const names = [...new Set(data.dancers.map(playedBy))].filter(Boolean);
  const found = names.map(async (name) => /** @type {[string, any]} */ ([name, await (name === "~" ? piece.mirrored() : piece.movements.load(name))]));
  return new Troupe(piece, data, new Map(await Promise.all(found)));
}

/** A movement that knows where its first posture stands. @param {any} motion */
function rooted(motion) {
  if (motion.root) return motion;
  const root = new Float64Array(3);
  motion.sample(motion.start, new Float64Array(4 * motion.joints.length), root);
  return Object.assign(motion, { root });
}
