/** The time line's actions, which buttons, keys and gestures share. */

import { bounded, fitting } from "./scale.js";
import {
  discard,
  duplicate,
  EMPTY,
  flip,
  insert,
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

const DURATION_STEP_S = 0.1; // of an insertion, for each key press
const ZOOM_RATIO = 1.4;

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
    /** The visible range: pixels a second, pixels scrolled past, and width in pixels. */
    this.sight = { scale: 60, left: 0, width: 800, fits: true };
    /** @type {Promise<any>} settles when all edits so far are answered */
    this.turn = Promise.resolve();
    /** @type {{name: string, by: number, done: Promise<any>} | null} steps that wait for their turn: further ones join them */
    this.steps = null;
    /** Whether the tracks have the focus. */
    this.focused = false;
    /** The piece's current time, seconds. */
    this.time = 0;
    this.listeners = new Set();
    const follow = () => {
      const { viewer } = studio;
      if (viewer.isHome && viewer.player) this.#pass(viewer.player.time, viewer.player.playing);
    };
    studio.viewer.addEventListener("show", follow);
    studio.viewer.player.addEventListener("change", follow);
  }

  /** Call a function with the current time, now and on changes; return a function that stops this. */
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
   * Send an edit, or the result of a function that runs after all earlier edits; null does nothing.
   * Show the server's errors.
   */
  edit(edit) {
    return this.#inTurn(() => this.#send(typeof edit === "function" ? edit() : edit));
  }

  /** Edit the current selection, in its state after all earlier edits. @param {(item: import("./items.js").Item) => any} make */
  #editSelected(make) {
    const { selection } = this.studio.store;
    return this.edit(() => make(selected(this.piece, selection) ?? {}));
  }

  /** Run an action after all earlier ones: keys come faster than answers. */
  #inTurn(doing) {
    this.steps = null;
    const done = this.turn.then(() => this.studio.api.changed).then(doing);
    this.turn = done.catch(() => {});
    return done;
  }

  /** Send an edit; return whether it succeeded. */
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

  /** Return the viewer to the piece. */
  look() {
    if (!this.studio.viewer.isHome) this.studio.viewer.back();
  }

  select(item) {
    this.studio.store.set({ selection: item ? selectionOf(item) : null });
  }

  /** Select the item `by` steps on. */
  go(by) {
    const item = neighbour(this.piece, this.studio.store.selection, by);
    if (item) this.select(item);
  }

  /** Show the piece at a time. */
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

  /** Trim a stretch by some frames, or change an insertion's duration by as many steps. Waiting steps become one edit. */
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
      return seam?.stands ? lasting(seam, lengthOf(seam) + steps.by * DURATION_STEP_S) : null;
    });
    this.steps = steps;
    return steps.done;
  }

  /** Set the duration of an insertion. */
  last(seam, seconds) {
    return this.edit(lasting(seam, seconds));
  }

  split() {
    const { time } = this;
    return this.#editSelected(({ block }) => {
      if (!block) return null;
      const edit = split(block, time, this.times(block), newId(this.studio.window));
      if (!edit) this.studio.say("Put the playhead inside the stretch to split it there.", { kind: "note" });
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

  /** Delete the stretch, or discard or restore the insertion. */
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

  /** Choose an insertion's alternative `by` steps on; move the playhead into the insertion. */
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
   * Change the wishes at a seam.
   * @param {import("./items.js").Seam} seam
   * @param {(ask: import("./items.js").Ask) => object} change returns the changes, given the wishes after all earlier edits
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

  /** Insert a posture, or a stretch from `frame` to `last`, before the stretch at an index. */
  insert(place, index) {
    return this.edit(insert(newId(this.studio.window), place, this.piece.blocks[index]?.id ?? null));
  }

  /** Times of a stretch's movement, if it has loaded. */
  times(block) {
    return this.movements.at(block.key)?.times;
  }

  /** Pause or resume smoothing in the background. */
  smooth(on) {
    return this.#sent(() => (on ? this.studio.api.post("/api/seams", {}) : this.studio.api.delete("/api/seams")));
  }

  /** Zoom by a factor; the time at `x` pixels from the left edge stays in place. */
  zoom(factor, x = this.sight.width / 2) {
    const { scale, left, width } = this.sight;
    const { seconds, blocks } = this.piece;
    const next = bounded(scale * factor, seconds, width, blocks.length);
    this.show({ scale: next, left: Math.max(((left + x) / scale) * next - x, 0), fits: false });
  }

  zoomIn() {
    this.zoom(ZOOM_RATIO, this.#middle());
  }

  zoomOut() {
    this.zoom(1 / ZOOM_RATIO, this.#middle());
  }

  fit() {
    const { seconds, blocks } = this.piece;
    this.show({ scale: fitting(seconds, this.sight.width, blocks.length), left: 0, fits: true });
  }

  /** The playhead if it is visible, or else the middle, in pixels from the left edge. */
  #middle() {
    const x = this.time * this.sight.scale - this.sight.left;
    return x >= 0 && x <= this.sight.width ? x : this.sight.width / 2;
  }

  /** Scroll a stretch of time into view. */
  reveal(at, seconds) {
    const { scale, left, width } = this.sight;
    const [from, to] = [at * scale, (at + seconds) * scale];
    const room = Math.min(48, width / 4);
    if (from < left + room) this.show({ left: Math.max(from - room, 0) });
    else if (to > left + width - room) this.show({ left: Math.max(Math.min(to - width + room, from - room), 0) });
  }
}
