/** The search for a variation: the wish, the server's proposal, and what to keep. It knows no views. */

import { points } from "./chart.js";

/**
 * @typedef {{seconds: number, least: number, most: number, inserted: number}} Forecast with all insertions; nine of ten
 *   last from `least` to `most`
 * @typedef {{id: string, source: string, first: number, last: number, mirrored: boolean, hold: number, pace: number, repeats: number}} Block
 * @typedef {{block: Block, place: number}} Kept
 * @typedef {{flow: string, depart: number, nudge: number | null, start: [number, number, number] | null, stretch: number, inserted: number | null, kept: Kept[], stay: string[]}} Wish
 * @typedef {object} Proposal
 * @property {{seconds: number, parts: any[], blocks: any[], seams: any[]}} piece the variation, in the format of a project's piece
 * @property {any[]} original parts of the original
 * @property {number[]} places of the blocks' first postures
 * @property {number} count of postures
 * @property {string[]} kept ids of the blocks that are kept
 * @property {string[]} locked ids of those among them that the time line keeps
 * @property {number} departs share of the steps that leave the order
 * @property {number} nudge
 * @property {number} every points of a trail from one posture to the next
 * @property {string} trail of the piece, float32 [N][3] in base64
 * @property {string} other trail of the variation, the same
 * @property {number[]} jumps postures of the variation that do not follow
 * @property {object} about the edit's description of it
 * @property {string} basis hash of the piece that it varies
 * @property {Forecast | null} forecast null if the corpus cannot tell how long insertions take
 * @property {string} unlimited why insertions could not be limited as wished; "" if they could
 */

/** The first wish: the defaults of `motionmind vary`. @returns {Wish} */
function firstWish() {
  return { flow: "lorenz", depart: 0.12, nudge: null, start: null, stretch: 4, inserted: 0.3, kept: [], stay: [] };
}

/** Fires "change" when the wish or the proposal has changed. */
export class Varying extends EventTarget {
  /** @param {{post: (path: string, body: object) => Promise<any>}} api */
  constructor(api) {
    super();
    this.api = api;
    this.wish = firstWish();
    /** @type {Proposal | null} */
    this.proposal = null;
    this.error = "";
    this.stale = false;
    /** @type {Promise<void> | null} settles with the latest request; null if there is none */
    this.answered = null;
    this.version = 0;
  }

  /** Whether a request is under way. */
  get asking() {
    return this.answered !== null;
  }

  /** Change the wish; of changes during a request only the latest is sent. @param {Partial<Wish>} change */
  want(change) {
    this.wish = { ...this.wish, ...change };
    this.#changed();
    return this.ask();
  }

  /** Request a variation; settles with the answer to the latest wish. */
  ask() {
    this.stale = true;
    this.answered ??= this.#ask();
    return this.answered;
  }

  async #ask() {
    while (this.stale) {
      this.stale = false;
      try {
        this.proposal = await this.api.post("/api/vary", this.wish);
        this.error = "";
      } catch (error) {
        this.error = /** @type {Error} */ (error).message;
      }
      this.#changed();
    }
    this.answered = null;
    this.#changed();
  }

  /** Move the start; during the drag keep the nudge, because a search for it takes time. @param {[number, number, number]} start */
  drag(start) {
    return this.want({ start, nudge: this.proposal?.nudge ?? null });
  }

  /** End the drag: search for the nudge that departs as far as wished. */
  drop() {
    return this.wish.nudge === null ? undefined : this.want({ nudge: null });
  }

  /** Start where the variation ends, elsewhere on the attractor. */
  another() {
    if (!this.proposal) return undefined;
    const end = points(this.proposal.other).slice(-3);
    return this.want({ start: [end[0], end[1], end[2]] });
  }

  /** Whether a block of the proposal is kept. @param {string} id */
  keeps(id) {
    return Boolean(this.proposal?.kept.includes(id));
  }

  /** Keep a block of the proposal in its place, or release it. @param {string} id */
  keep(id) {
    if (!this.proposal) return undefined;
    if (this.wish.stay.includes(id)) return this.want({ stay: this.wish.stay.filter((other) => other !== id) });
    const { piece, places } = this.proposal;
    const kept = this.wish.kept.filter(({ block }) => block.id !== id);
    if (kept.length === this.wish.kept.length) {
      const at = piece.blocks.findIndex((block) => block.id === id);
      if (at >= 0) kept.push({ block: bare(piece.blocks[at]), place: places[at] });
    }
    kept.sort((one, other) => one.place - other.place);
    return this.want({ kept });
  }

  /** Keep a stretch of the piece in its place. @param {string} id */
  stay(id) {
    return this.want({ stay: [...this.wish.stay, id] });
  }

  /** Keep nothing. */
  letGo() {
    return this.want({ kept: [], stay: [] });
  }

  /** The edit that makes the proposal the piece. */
  get edit() {
    return this.proposal && { edit: "arrange", blocks: this.proposal.piece.blocks.map(bare), about: this.proposal.about };
  }

  #changed() {
    this.version += 1;
    this.dispatchEvent(new Event("change"));
  }
}

/** @param {Block} block */
function bare({ id, source, first, last, mirrored, hold, pace, repeats }) {
  return { id, source, first, last, mirrored, hold, pace, repeats };
}

/** Whether two lists of blocks are equal. @param {Block[]} one @param {Block[]} other */
export function alike(one, other) {
  return one.length === other.length && one.every((block, i) => JSON.stringify(bare(block)) === JSON.stringify(bare(other[i])));
}

/** How far it departs, in words. @param {number} share of the steps */
export function departure(share) {
  if (share < 0.005) return "unchanged";
  return `1 step in ${Math.max(Math.round(1 / share), 1)}`;
}

/** The share of its time that insertions take. @param {{seconds: number, parts: any[]}} piece */
export function insertedShare({ seconds, parts }) {
  return parts.reduce((sum, part) => sum + (part.inserted ? part.seconds : 0), 0) / Math.max(seconds, 1e-9);
}

/** The place among all postures at a time, with its fraction. @param {Proposal} proposal @param {number} time */
export function placeAt({ piece, places, count }, time) {
  const { blocks } = piece;
  let at = 0;
  while (at + 1 < blocks.length && blocks[at + 1].at <= time) at++;
  const { at: begin, seconds } = blocks[at];
  const room = (places[at + 1] ?? count) - places[at];
  return places[at] + Math.min(Math.max((time - begin) / Math.max(seconds, 0.01), 0), 1) * Math.max(room - 1, 0);
}
