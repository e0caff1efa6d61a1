/** What one can do on the line of time, each action once: buttons, keys and gestures call the same. */

import { bounded, fitting } from "./scale.js";
import {
  discard,
  duplicate,
  EMPTY,
  flip,
  lasting,
  lengthOf,
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
    /** @type {Promise<any>} over when the edits that were asked for are answered */
    this.turn = Promise.resolve();
    /** @type {{name: string, by: number, done: Promise<any>} | null} steps whose turn is still to come: more join them */
    this.steps = null;
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

  /** @returns {import("./items.js").Piece} */
  get piece() {
    return this.studio.store.state?.piece ?? EMPTY;
  }

  get item() {
    return selected(this.piece, this.studio.store.selection);
  }

  /**
   * Send an edit, or what a function makes of the piece as all that was done before has left it; null does nothing.
   * What the server refuses is said in a line.
   */
  edit(edit) {
    return this.#inTurn(() => this.#send(typeof edit === "function" ? edit() : edit));
  }

  /** Edit what is selected now, as it is when it is its turn. @param {(item: import("./items.js").Item) => any} make */
  #editSelected(make) {
    const { selection } = this.studio.store;
    return this.edit(() => make(selected(this.piece, selection) ?? {}));
  }

  /** Do something once all that was done before is answered: keys are pressed faster than that. */
  #inTurn(doing) {
    this.steps = null;
    const done = this.turn.then(() => this.studio.api.changed).then(doing);
    this.turn = done.catch(() => {});
    return done;
  }

  /** Whether an edit was sent, and done. */
  async #send(edit) {
    if (!edit) return false;
    this.look();
    return this.#sent(() => this.studio.api.edit(edit));
  }

  async #sent(send) {
    try {
      await send();
      return true;
    } catch (error) {
      this.studio.say(error instanceof Error ? error.message : String(error), { kind: "error" });
      return false;
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
    return this.#editSelected(
      ({ block }) => block && move(this.piece, block, this.piece.blocks.findIndex(({ id }) => id === block.id) + by),
    );
  }

  /** Let a stretch begin or end `by` frames later, or an insertion last longer. Steps that wait are taken as one. */
  trimBy(side, by) {
    const { selection } = this.studio.store;
    const name = `${side} ${nameOf(selection)}`;
    if (this.steps?.name === name) {
      this.steps.by += by;
      return this.steps.done;
    }
    const steps = { name, by, done: Promise.resolve() };
    steps.done = this.edit(() => {
      if (this.steps === steps) this.steps = null;
      const { block, seam } = selected(this.piece, selection) ?? {};
      if (block) return trim(block, side, block[side] + steps.by);
      return seam?.stands ? lasting(seam, lengthOf(seam) + steps.by * LONGER) : null;
    });
    this.steps = steps;
    return steps.done;
  }

  /** Let an insertion last some seconds. */
  last(seam, seconds) {
    return this.edit(lasting(seam, seconds));
  }

  split() {
    const { time } = this;
    return this.#editSelected(({ block }) => {
      if (!block) return null;
      const edit = split(block, time, this.times(block), newId(this.studio.window));
      if (!edit) this.studio.say("put the playhead inside the stretch to split it there", { kind: "note" });
      return edit;
    });
  }

  async duplicate() {
    const id = newId(this.studio.window);
    await this.#editSelected(({ block }) => block && duplicate(this.piece, block, id));
    if (this.piece.blocks.some((one) => one.id === id)) this.studio.store.set({ selection: { block: id } });
  }

  mirror() {
    return this.#editSelected(({ block }) => block && { edit: "mirror", block: block.id });
  }

  /** Delete the stretch, or discard the insertion or restore it. */
  remove() {
    const { selection } = this.studio.store;
    return this.#inTurn(async () => {
      const { block, seam } = selected(this.piece, selection) ?? {};
      if (seam && seam.alternatives.length > 0) await this.#send(discard(seam));
      if (!block) return;
      const at = this.piece.blocks.findIndex(({ id }) => id === block.id);
      const next = this.piece.blocks[at + 1] ?? this.piece.blocks[at - 1];
      const done = await this.#send({ edit: "delete", block: block.id });
      if (done) this.studio.store.set({ selection: next ? { block: next.id } : null });
    });
  }

  /** Show an insertion's alternative `by` places on: at the playhead if it is in it, or else in its middle. */
  flip(by) {
    return this.#editSelected(({ seam }) => {
      const change = seam && flip(seam, by);
      if (!change) return null;
      const { at, seconds } = seam;
      if (this.time <= at || this.time >= at + seconds) this.seek(at + seconds / 2);
      return change;
    });
  }

  lock() {
    return this.#editSelected(({ seam }) => seam && seam.alternatives.length > 0 && lock(seam));
  }

  /**
   * Wish for something else at a seam.
   * @param {import("./items.js").Seam} seam
   * @param {(ask: import("./items.js").Ask) => object} change returns what is different from what is wished when it is its turn
   */
  wish({ left, right }, change) {
    return this.edit(() => {
      const now = selected(this.piece, { seam: [left, right] })?.seam;
      return now && wish(now, change(now.ask));
    });
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
