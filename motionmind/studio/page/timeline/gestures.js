/** Drags on the tracks: the draft that they show, and the edit that they end in. */

import { frameAt, move, placeAt, trim } from "./items.js";

const CLICK_SLACK_PX = 4;

/**
 * A drag, from pointer down to pointer up.
 * `draft` is what the tracks show meanwhile: {kind: "move", id, by, place}, {kind: "trim", id, side, frame} or
 * {kind: "last", left, right, seconds}.
 */
export class Drag {
  /**
   * @param {import("./actions.js").Actions} does
   * @param {any} held {kind, block or seam, side}
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
    if (held.kind === "move") {
      this.draft = { kind: "move", id: block.id, by, place: placeAt(does.piece, time, block.id) };
    } else if (held.kind === "trim") {
      const wanted = frameAt(block, time, does.times(block));
      const edit = trim(block, side, wanted);
      this.draft = { kind: "trim", id: block.id, side, frame: edit ? edit[side] : block[side] };
    } else if (held.kind === "last") {
      this.draft = { kind: "last", left: seam.left, right: seam.right, seconds: Math.max(time - seam.at, 0.1) };
    }
    return this.draft;
  }

  /** Send the drag's edit. */
  async end() {
    const { does, held, draft } = this;
    if (!draft) return;
    if (draft.kind === "move") await does.edit(move(does.piece, held.block, draft.place));
    else if (draft.kind === "trim") await does.edit(trim(held.block, draft.side, draft.frame));
    else if (draft.kind === "last") await does.last(held.seam, draft.seconds);
  }
}

/** The duration of a block while it is trimmed, and how much later it begins, seconds. */
export function trimmed(block, { side, frame }, times) {
  const at = (which) =>
    times ? times[which] : (which * block.seconds) / Math.max(block.last - block.first, 1);
  const [first, last] = side === "first" ? [frame, block.last] : [block.first, frame];
  return { seconds: at(last) - at(first), later: at(first) - at(block.first) };
}
