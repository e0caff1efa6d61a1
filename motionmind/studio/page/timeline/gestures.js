/** Drags on the tracks: the draft that they show, and the edit that they end in. */

import { moveGroup } from "./groups.js";
import { FASTEST, frameAt, holding, isPosture, placeAt, play, SLOWEST, trim } from "./items.js";

const CLICK_SLACK_PX = 4;

/**
 * A drag, from pointer down to pointer up.
 * `draft` is what the tracks show meanwhile: {kind: "move", ids, by, place}, {kind: "trim", id, side, frame},
 * {kind: "hold", id, seconds}, {kind: "pace", id, side, pace} or {kind: "last", left, right, seconds}.
 */
export class Drag {
  /**
   * @param {import("./actions.js").Actions} does
   * @param {any} held {kind, block or seam, side, group: the stretches that move}
   * @param {PointerEvent} event
   */
  constructor(does, held, event) {
    this.does = does;
    this.held = held;
    this.from = event.clientX + does.sight.left;
    this.moved = false;
    /** @type {any} */
    this.draft = null;
  }

  /** Follow the pointer; return the draft. @param {PointerEvent} event @param {number} edge of the tracks */
  take(event, edge) {
    const { does, held } = this;
    const by = event.clientX + does.sight.left - this.from;
    if (!this.moved && Math.abs(by) < CLICK_SLACK_PX) return null;
    this.moved = true;
    const time = (event.clientX - edge + does.sight.left) / does.sight.scale;
    const { block, seam, side } = held;
    /** How far the dragged edge moves, given where it was, seconds: to a count, if times snap. */
    const moved = (edgeAt) => does.near(edgeAt + by / does.sight.scale) - edgeAt;
    if (held.kind === "move") {
      const ids = held.group.map((/** @type {any} */ { id }) => id);
      this.draft = { kind: "move", ids, by, place: placeAt(does.piece, time, ids) };
    } else if (held.kind === "trim" && isPosture(block)) {
      this.draft = { kind: "hold", id: block.id, seconds: Math.max(block.hold + moved(block.at + block.hold), 0) };
    } else if (held.kind === "trim" && (event.altKey || event.ctrlKey)) {
      const longer = (side === "last" ? moved(block.at + block.seconds) : -moved(block.at)) / block.repeats;
      const pace = (block.once * block.pace) / Math.max(block.once + longer, 1e-3);
      this.draft = { kind: "pace", id: block.id, side, pace: Math.min(Math.max(pace, SLOWEST), FASTEST) };
    } else if (held.kind === "trim") {
      const own = does.near(time) - (side === "last" ? block.seconds - block.once : 0); // in the first of its repeats
      const wanted = frameAt(block, own, does.times(block));
      const edit = trim(block, side, wanted);
      this.draft = { kind: "trim", id: block.id, side, frame: edit ? edit[side] : block[side] };
    } else if (held.kind === "last") {
      this.draft = { kind: "last", left: seam.left, right: seam.right, seconds: Math.max(does.near(time) - seam.at, 0.1) };
    }
    return this.draft;
  }

  /** Send the drag's edit. */
  async end() {
    const { does, held, draft } = this;
    if (!draft) return;
    if (draft.kind === "move") await does.edit(moveGroup(does.piece, held.group, draft.place));
    else if (draft.kind === "pace") await does.edit(play(held.block, { pace: draft.pace }));
    else if (draft.kind === "hold") await does.edit(holding(held.block, draft.seconds));
    else if (draft.kind === "trim") await does.edit(trim(held.block, draft.side, draft.frame));
    else if (draft.kind === "last") await does.last(held.seam, draft.seconds);
  }
}

/** The duration of a block while it is trimmed or stretched, and how much later it begins, seconds. */
export function trimmed(block, { kind, side, frame, pace }, times) {
  const between = block.seconds - block.once * block.repeats; // insertions
  if (kind === "pace") {
    const long = ((block.once * block.pace) / pace) * block.repeats + between;
    return { seconds: long, later: side === "first" ? block.seconds - long : 0 };
  }
  const at = (which) =>
    (times ? times[which] / block.pace : (which * block.once) / Math.max(block.last - block.first, 1));
  const [first, last] = side === "first" ? [frame, block.last] : [block.first, frame];
  return { seconds: (at(last) - at(first)) * block.repeats + between, later: at(first) - at(block.first) };
}
