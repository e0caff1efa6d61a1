/** The time line's items, stretches and seams in order, and the edits for gestures on them. */

import { lastBefore } from "./composed.js";

/**
 * @typedef {{posture: string, frame: number}} Passing
 * @typedef {{joint: string, hold: "start"|"end"|"throughout"|"place", begins: number, ends: number}} Pin
 * @typedef {{seconds: number|null, passing: Passing[], pins: Pin[], reaches: import("../asks/asked.js").Reach[],
 *   travel: import("../asks/asked.js").Travel | null}} Ask
 * @typedef {{id: string, source: string, first: number, last: number, mirrored: boolean, hold: number, pace: number,
 *   repeats: number, key: string, title: string, frames: number, missing: boolean, at: number, once: number,
 *   seconds: number}} Block
 * @typedef {{left: string, right: string, number: number, state: string, words: string, chosen: number,
 *   alternatives: {key: string, seconds: number, words: string}[], decision: string, ask: Ask, at: number, stands: boolean,
 *   seconds: number}} Seam
 * @typedef {{block?: Block, seam?: Seam}} Item
 * @typedef {{blocks: Block[], seams: Seam[], parts: object[], notes: any[], seconds: number}} Piece
 */

/** An empty piece. @type {Piece} */
export const EMPTY = { seconds: 0, parts: [], blocks: [], seams: [], notes: [] };
export const [SHORTEST, LONGEST] = [0.1, 60]; // seconds of an insertion, as a wish
export const LONGEST_HOLD = 3600; // seconds of a posture
export const [SLOWEST, FASTEST] = [0.5, 2]; // multiples of the recorded pace
export const MOST_REPEATS = 100;

/** The item that a selection names, or undefined. @param {Piece} piece */
export function selected(piece, selection) {
  if (selection?.block) {
    const block = piece.blocks.find(({ id }) => id === selection.block);
    return block && { block };
  }
  if (selection?.seam) {
    const [left, right] = selection.seam;
    const seam = piece.seams.find((one) => one.left === left && one.right === right);
    return seam && { seam };
  }
  return undefined;
}

/** The selection that names an item. @param {Item} item */
export function selectionOf({ block, seam }) {
  return seam ? { seam: [seam.left, seam.right] } : { block: block?.id };
}

/** A unique text for a selection. */
export function nameOf(selection) {
  if (selection?.block) return `block ${selection.block}`;
  return selection?.seam ? `seam ${selection.seam.join(" ")}` : "";
}

/** Whether to show a seam: not one that continues as recorded. @param {Seam} seam */
export function shown(seam) {
  return seam.words !== "continues as recorded";
}

/** The item `by` places on from the selected one. @param {Piece} piece */
export function neighbour(piece, selection, by) {
  const items = [];
  let next = 0;
  for (const block of piece.blocks) {
    items.push({ block });
    for (; piece.seams[next]?.left === block.id; next++) if (shown(piece.seams[next])) items.push({ seam: piece.seams[next] });
  }
  const name = nameOf(selection);
  const at = items.findIndex((item) => nameOf(selectionOf(item)) === name);
  if (at < 0) return by > 0 ? items[0] : items.at(-1);
  return items[Math.min(Math.max(at + by, 0), items.length - 1)];
}

/** The range of ordered items that overlap the time from `from` to `to`: [first, stop]. */
export function inSight(items, from, to) {
  if (items.length === 0) return [0, 0];
  const start = (item) => item.at;
  let first = lastBefore(items, from, start);
  // Items follow each other in time, but a held posture is drawn wider than its duration.
  while (first > 0 && items[first].at + items[first].seconds >= from) first--;
  return [first, Math.min(lastBefore(items, to, start) + 1, items.length)];
}

let made = 0;

/**
 * Insert a posture, or the frames of a movement up to `last`, before a block or at the end.
 * @param {string} id the new block's
 * @param {{key: string, frame: number, last?: number}} place
 */
export function insert(id, { key, frame, last = frame }, /** @type {string | null} */ before = null) {
  return { edit: "insert", id, source: key, first: frame, last, mirrored: false, before };
}

/** An id that no block has. @param {string} window this window's name */
export function newId(window) {
  made += 1;
  return `${window}.${Date.now().toString(36)}.${made}`.slice(-40);
}

/** Insert a copy of a block after it. @param {Piece} piece @param {Block} block */
export function duplicate(piece, block, id) {
  const { source, first, last, mirrored, hold, pace, repeats } = block;
  const after = piece.blocks[piece.blocks.findIndex((one) => one.id === block.id) + 1];
  return { edit: "insert", id, source, first, last, mirrored, hold, pace, repeats, before: after?.id ?? null };
}

/** Move a block to index `to`; null if it is there. @param {Piece} piece */
export function move(piece, block, to) {
  const rest = piece.blocks.filter((one) => one.id !== block.id);
  const at = piece.blocks.findIndex((one) => one.id === block.id);
  const place = Math.min(Math.max(to, 0), rest.length);
  if (place === at) return null;
  return { edit: "move", block: block.id, before: rest[place]?.id ?? null };
}

/** The index, without the blocks `without`, for a drop at `time`. @param {Piece} piece @param {string[]} without */
export function placeAt(piece, time, without = []) {
  return piece.blocks.filter(({ id, at, seconds }) => !without.includes(id) && at + seconds / 2 < time).length;
}

/** The frame of a block at `time`, in the first of its repeats. @param {Block} block @param {Float64Array|undefined} times its movement's */
export function frameAt(block, time, times) {
  if (times) {
    const wanted = times[block.first] + (time - block.at) * block.pace;
    const own = lastBefore(times, wanted);
    const later = Math.min(own + 1, times.length - 1);
    return Math.abs(times[later] - wanted) < Math.abs(times[own] - wanted) ? later : own;
  }
  const rate = (block.last - block.first) / Math.max(block.once, 1e-6);
  return Math.min(Math.max(Math.round(block.first + (time - block.at) * rate), 0), block.frames - 1);
}

/** Change the first or last frame of a block; null if it is the same. @param {Block} block */
export function trim(block, side, frame) {
  const { id, first, last, frames } = block;
  const to = side === "first" ? Math.min(Math.max(frame, 0), last) : Math.min(Math.max(frame, first), frames - 1);
  if (to === block[side]) return null;
  return { edit: "trim", block: id, first, last, [side]: to };
}

/** Whether a block is a posture, which can be held. @param {Block} block */
export function isPosture({ first, last }) {
  return first === last;
}

/** Hold a posture for some seconds; null if it is. @param {Block} block */
export function holding(block, seconds) {
  const to = Math.round(Math.min(Math.max(seconds || 0, 0), LONGEST_HOLD) * 1000) / 1000;
  return to === block.hold ? null : { edit: "hold", block: block.id, seconds: to };
}

/** Play a block at another pace, or another number of times; null if it does. @param {Block} block */
export function play(block, { pace = block.pace, repeats = block.repeats }) {
  const wanted = {
    pace: Math.round(Math.min(Math.max(pace || 1, SLOWEST), FASTEST) * 1000) / 1000,
    repeats: Math.min(Math.max(Math.round(repeats || 1), 1), MOST_REPEATS),
  };
  if (isPosture(block) || (wanted.pace === block.pace && wanted.repeats === block.repeats)) return null;
  return { edit: "play", block: block.id, ...wanted };
}

/**
 * Split a block at a time, in the playing that is then; null if the time is in none.
 * @param {Block} block @param {string} window
 */
export function split(block, time, times, window) {
  const every = block.repeats > 1 ? (block.seconds - block.once) / (block.repeats - 1) : block.seconds; // with its insertion
  const turn = Math.min(Math.floor((time - block.at) / every), block.repeats - 1) + 1;
  const own = time - (turn - 1) * every;
  if (own <= block.at || own >= block.at + block.once) return null;
  const at = Math.min(Math.max(frameAt(block, own, times), block.first + 1), block.last);
  const others = { turn, half: newId(window), rest: newId(window) };
  return { edit: "split", block: block.id, at, id: newId(window), ...(block.repeats > 1 && others) };
}

/** Change the wishes at a seam. @param {Seam} seam @param {Partial<Ask>} change */
export function wish({ left, right, ask }, change) {
  return { edit: "ask", left, right, ...ask, ...change };
}

/** Set the duration of a seam's insertion. @param {Seam} seam */
export function lasting(seam, seconds) {
  return wish(seam, { seconds: Math.round(Math.min(Math.max(seconds, SHORTEST), LONGEST) * 1000) / 1000 });
}

/** The duration of an insertion, or the wished one until it is found. @param {Seam} seam */
export function lengthOf({ state, seconds, ask }) {
  return (state === "inserted" ? null : ask.seconds) ?? seconds;
}

/** Add a posture for a seam's insertion to pass, at a share of its duration. @param {Seam} seam */
export function pass(seam, posture, share = 1) {
  const passing = [...seam.ask.passing];
  passing.splice(Math.round(share * passing.length), 0, posture);
  return wish(seam, { passing });
}

/** Choose the alternative `by` steps on; null if there is only one. @param {Seam} seam */
export function flip({ left, right, chosen, alternatives }, by) {
  const count = alternatives.length;
  if (count < 2) return null;
  return { edit: "choose", left, right, alternative: ((((chosen - 1 + by) % count) + count) % count) + 1 };
}

/** Discard a seam's insertion, or restore it. @param {Seam} seam */
export function discard({ left, right, decision }) {
  return { edit: "decide", left, right, decision: decision === "discarded" ? "open" : "discarded" };
}

/** Lock a seam's insertion, or unlock it. @param {Seam} seam */
export function lock({ left, right, decision }) {
  return { edit: "decide", left, right, decision: decision === "locked" ? "open" : "locked" };
}
