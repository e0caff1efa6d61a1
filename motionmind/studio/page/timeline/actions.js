/** What one can do on the line of time, each action once: buttons, keys and gestures call the same. */

import { bounded, fitting } from "./scale.js";
import {
  discard,
  duplicate,
  flip,
  lock,
  move,
  nameOf,
  neighbour,
  newId,
  pass,
  selected,
  selectionOf,
  split,
  trim,
  wish,
} from "./items.js";

const LONGER = 0.1; // seconds by which a key makes an insertion longer
const SHORTEST = 0.1;
const ZOOM = 1.4;

export class Actions {
  /**
   * @param {object} studio
   * @param {import("./composed.js").Movements} movements
   * @param {(change: object) => void} show changes the panel's own state: {scale, left, fits, sheet}
   */
  constructor(studio, movements, show) {
    this.studio = studio;
    this.movements = movements;
    this.show = show;
    /** What is in sight: pixels a second, pixels to the left of it, and its width. */
    this.sight = { scale: 60, left: 0, width: 800, fits: true };
    /** @type {import("./items.js").Piece} */
    this.piece = { blocks: [], seams: [], parts: [], seconds: 0 };
    /** Whether the keys' focus is on the tracks. */
    this.focused = false;
    /** The moment of the piece that is shown, or was last, seconds. */
    this.time = 0;
    this.listeners = new Set();
    const follow = () => {
      const { viewer } = studio;
      if (viewer.isHome && viewer.player) this.#pass(viewer.player.time, viewer.player.playing);
    };
    studio.viewer.addEventListener("show", follow);
    studio.viewer.player.addEventListener("change", follow);
  }

  /** Call a function with each moment that is shown, and now; returns what stops that. */
  onTime(listener) {
    this.listeners.add(listener);
    listener(this.time);
    return () => this.listeners.delete(listener);
  }

  #pass(time, playing) {
    if (time === this.time) return;
    this.time = time;
    for (const listener of this.listeners) listener(time);
    const { scale, left, width } = this.sight;
    const x = time * scale - left;
    if (playing && (x < 0 || x > width)) this.show({ left: Math.max(time * scale - width / 8, 0) });
  }

  get item() {
    return selected(this.piece, this.studio.store.selection);
  }

  /** Send an edit; null does nothing. What the server refuses is said in a line. */
  async edit(edit) {
    if (!edit) return;
    this.look();
    await this.#sent(() => this.studio.api.edit(edit));
  }

  async #sent(send) {
    try {
      await send();
    } catch (error) {
      this.studio.say(error instanceof Error ? error.message : String(error), { kind: "error" });
    }
  }

  /** Show the piece, if something else is looked at. */
  look() {
    if (!this.studio.viewer.isHome) this.studio.viewer.back();
  }

  select(item) {
    this.studio.store.set({ selection: item ? selectionOf(item) : null });
  }

  /** Select the item `by` places on. */
  go(by) {
    const item = neighbour(this.piece, this.studio.store.selection, by);
    if (item) this.select(item);
  }

  /** Show the moment that an item begins with. */
  seek(time) {
    this.look();
    const { player } = this.studio.viewer;
    player.pause();
    player.seek(time);
  }

  moveBy(by) {
    const { block } = this.item ?? {};
    if (!block) return undefined;
    return this.edit(move(this.piece, block, this.piece.blocks.findIndex(({ id }) => id === block.id) + by));
  }

  /** Let a stretch begin or end `by` frames later, or an insertion last longer. */
  trimBy(side, by) {
    const { block, seam } = this.item ?? {};
    if (block) return this.edit(trim(block, side, block[side] + by));
    return seam?.state === "inserted" ? this.last(seam, seam.seconds + by * LONGER) : undefined;
  }

  /** Let an insertion last some seconds. */
  last(seam, seconds) {
    return this.edit(wish(seam, { seconds: Math.round(Math.max(seconds, SHORTEST) * 100) / 100 }));
  }

  split() {
    const { block } = this.item ?? {};
    if (!block) return undefined;
    const edit = split(block, this.time, this.times(block), newId(this.studio.window));
    if (!edit) this.studio.say("put the playhead inside the stretch to split it there", { kind: "note" });
    return this.edit(edit);
  }

  async duplicate() {
    const { block } = this.item ?? {};
    if (!block) return;
    const id = newId(this.studio.window);
    await this.edit(duplicate(this.piece, block, id));
    if (this.studio.store.state.piece.blocks.some((one) => one.id === id)) this.studio.store.set({ selection: { block: id } });
  }

  mirror() {
    const { block } = this.item ?? {};
    return block && this.edit({ edit: "mirror", block: block.id });
  }

  /** Delete the stretch, or discard the insertion or restore it. */
  async remove() {
    const { block, seam } = this.item ?? {};
    if (seam) {
      if (seam.alternatives.length > 0) await this.edit(discard(seam));
    } else if (block) {
      const at = this.piece.blocks.findIndex(({ id }) => id === block.id);
      const next = this.piece.blocks[at + 1] ?? this.piece.blocks[at - 1];
      await this.edit({ edit: "delete", block: block.id });
      this.studio.store.set({ selection: next ? { block: next.id } : null });
    }
  }

  /** Show an insertion's alternative `by` places on: at the playhead if it is in it, or else in its middle. */
  flip(by) {
    const { seam } = this.item ?? {};
    const change = seam && flip(seam, by);
    if (!change) return undefined;
    const { at, seconds } = seam;
    if (this.time <= at || this.time >= at + seconds) this.seek(at + seconds / 2);
    return this.edit(change);
  }

  lock() {
    const { seam } = this.item ?? {};
    return seam && seam.alternatives.length > 0 && this.edit(lock(seam));
  }

  pass(seam, posture, share = 1) {
    return this.edit(pass(seam, posture, share));
  }

  /** Put a posture, or a stretch from `frame` to `last`, into the piece, before a place among the stretches. */
  insert({ key, frame, last = frame }, place) {
    const before = this.piece.blocks[place]?.id ?? null;
    const id = newId(this.studio.window);
    return this.edit({ edit: "insert", id, source: key, first: frame, last, mirrored: false, before });
  }

  /** Times of a stretch's movement, if it has come. */
  times(block) {
    return this.movements.at(block.key)?.times;
  }

  /** Stop smoothing in the background, or let it go on. */
  smooth(on) {
    return this.#sent(() => (on ? this.studio.api.post("/api/seams", {}) : this.studio.api.delete("/api/seams")));
  }

  /** Zoom by a factor, so that the time at `x` pixels from the left edge stays where it is. */
  zoom(factor, x = this.sight.width / 2) {
    const { scale, left, width } = this.sight;
    const { seconds, blocks } = this.piece;
    const next = bounded(scale * factor, seconds, width, blocks.length);
    this.show({ scale: next, left: Math.max(((left + x) / scale) * next - x, 0), fits: false });
  }

  zoomIn() {
    this.zoom(ZOOM, this.#middle());
  }

  zoomOut() {
    this.zoom(1 / ZOOM, this.#middle());
  }

  fit() {
    const { seconds, blocks } = this.piece;
    this.show({ scale: fitting(seconds, this.sight.width, blocks.length), left: 0, fits: true });
  }

  /** The playhead if it is in sight, or else the middle, in pixels from the left edge. */
  #middle() {
    const x = this.time * this.sight.scale - this.sight.left;
    return x >= 0 && x <= this.sight.width ? x : this.sight.width / 2;
  }

  /** Scroll so far that a stretch of time is in sight. */
  reveal(at, seconds) {
    const { scale, left, width } = this.sight;
    const [from, to] = [at * scale, (at + seconds) * scale];
    const room = Math.min(48, width / 4);
    if (from < left + room) this.show({ left: Math.max(from - room, 0) });
    else if (to > left + width - room) this.show({ left: Math.max(Math.min(to - width + room, from - room), 0) });
  }

  /** Whether a selection names this item. */
  isSelected(item) {
    return nameOf(this.studio.store.selection) === nameOf(selectionOf(item));
  }
}
