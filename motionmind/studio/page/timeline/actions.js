/** The time line's actions, which buttons, keys and gestures share. */

import { castOf } from "../dancers/cast.js";
import { copyGroup, groupOf, moveGroup, reaching, together } from "./groups.js";
import { noteFrom } from "./notes.js";
import { meterOf, recount } from "../music/beats.js";
import { countFrom, fitting, middleOf, nearestCount, revealing, zoomed } from "./scale.js";
import {
  discard,
  EMPTY,
  flip,
  holding,
  insert,
  isPosture,
  lasting,
  lengthOf,
  LONGEST,
  lock,
  nameOf,
  neighbour,
  newId,
  pass,
  play,
  selected,
  selectionOf,
  SHORTEST,
  split,
  trim,
  wish,
} from "./items.js";

const DURATION_STEP_S = 0.1; // of an insertion or a held posture, for each key press
const PACE_STEP = 0.05; // of the recorded pace, for each key press
const ZOOM_RATIO = 1.4;

export class Actions {
  /**
   * @param {object} studio
   * @param {import("./composed.js").Movements} movements
   * @param {(change: object) => void} show changes the panel's own state: {scale, left, fits, sheet, snaps}
   */
  constructor(studio, movements, show) {
    this.studio = studio;
    this.movements = movements;
    this.show = show;
    /** The visible range: pixels a second, pixels scrolled past, and width in pixels. */
    this.sight = { scale: 60, left: 0, width: 800, fits: true, snaps: false };
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
      if (viewer.isHome && viewer.player) this.#pass(viewer.own, viewer.player);
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

  #pass(time, player) {
    if (time !== this.time) {
      this.time = time;
      for (const listener of this.listeners) listener(time);
    }
    const { scale, left, width } = this.sight;
    const x = player.time * scale; // of all dancers: theirs goes on while the piece waits
    if (player.playing && (x < left || x > left + width)) this.show({ left: Math.max(x - width / 8, 0) });
  }

  /** @returns {import("./items.js").Piece} */
  get piece() {
    return this.studio.store.state?.piece ?? EMPTY;
  }

  /** @returns {import("./scale.js").Meter} */
  get meter() {
    return meterOf(this.studio.store.state);
  }

  snap() {
    this.show({ snaps: !this.sight.snaps });
  }

  /** The count nearest to a time, if times snap; otherwise the time. */
  near(time) {
    return this.sight.snaps ? nearestCount(time, this.meter) : time;
  }

  /** How long something that begins at a time and lasts some seconds lasts after some key presses: steps, or counts. */
  #after(at, seconds, steps) {
    return this.sight.snaps ? countFrom(at + seconds, steps, this.meter) - at : seconds + steps * DURATION_STEP_S;
  }

  /** Count the piece by another tempo, or in other phrases. @param {{tempo?: number, counts?: number}} change */
  count(change) {
    return this.edit(() => recount(this.studio.store.state, change));
  }

  /** Have an insertion end at a time of the piece, as it is now. */
  land(seam, time) {
    if (time - seam.at < SHORTEST || time - seam.at > LONGEST) {
      const [first, last] = [seam.at + SHORTEST, seam.at + LONGEST].map((one) => one.toFixed(2));
      this.studio.say(`This insertion can land from ${first} to ${last} s.`, { kind: "note" });
      return Promise.resolve();
    }
    return this.last(seam, time - seam.at);
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

  /** Select the stretch `by` steps on, too. */
  extend(by) {
    const { selection } = this.studio.store;
    const { blocks } = this.piece;
    const at = blocks.findIndex(({ id }) => id === selection?.block);
    const next = at < 0 ? undefined : blocks[at + by];
    if (next) this.studio.store.set({ selection: reaching(selection, next.id) });
  }

  /** Select only the stretch with the focus. */
  single() {
    const { selection } = this.studio.store;
    if (selection?.from) this.studio.store.set({ selection: { block: selection.block } });
  }

  /** Edit the selected stretches, in their state after all earlier edits. @param {(group: any[]) => any} make */
  #editGroup(make) {
    const { selection } = this.studio.store;
    return this.edit(() => make(groupOf(this.piece, selection)));
  }

  /** Write a note at the playhead. */
  note() {
    this.look();
    this.studio.viewer.player.pause();
    this.show({ note: "new" });
  }

  /** Go to the note before or after the playhead. */
  toNote(by) {
    const note = noteFrom(this.piece.notes, this.time, by);
    if (!note) return;
    this.seek(note.at);
    this.reveal(note.at, 0);
  }

  /** Show the piece at a time. */
  seek(time) {
    this.look();
    const { player } = this.studio.viewer;
    player.pause();
    player.seek(this.studio.viewer.clock(time));
  }

  moveBy(by) {
    return this.#editGroup((group) =>
      moveGroup(this.piece, group, this.piece.blocks.findIndex(({ id }) => id === group[0]?.id) + by),
    );
  }

  /**
   * Trim a stretch by some frames, or change the duration of a posture or an insertion by as many steps. Waiting steps
   * become one edit.
   */
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
      if (block && side === "last" && isPosture(block)) return holding(block, this.#after(block.at, block.hold, steps.by));
      if (block) return trim(block, side, block[side] + steps.by);
      return seam?.stands ? lasting(seam, this.#after(seam.at, lengthOf(seam), steps.by)) : null;
    });
    this.steps = steps;
    return steps.done;
  }

  /** Set the duration of an insertion. */
  last(seam, seconds) {
    return this.edit(lasting(seam, seconds));
  }

  /** Hold a posture for some seconds, after all earlier edits. @param {import("./items.js").Block} block */
  hold({ id }, seconds) {
    return this.edit(() => {
      const { block } = selected(this.piece, { block: id }) ?? {};
      return block && holding(block, seconds);
    });
  }

  /**
   * Change a stretch's pace or repeats, given after all earlier edits; of the selected one by default.
   * @param {(block: import("./items.js").Block) => {pace?: number, repeats?: number}} change
   */
  play(change, selection = this.studio.store.selection) {
    return this.edit(() => {
      const { block } = selected(this.piece, selection) ?? {};
      return block && play(block, change(block));
    });
  }

  paceBy(steps) {
    return this.play(({ pace }) => ({ pace: Math.round((pace + steps * PACE_STEP) * 100) / 100 }));
  }

  repeatBy(by) {
    return this.play(({ repeats }) => ({ repeats: repeats + by }));
  }

  split() {
    const { time } = this;
    return this.#editSelected(({ block }) => {
      if (!block) return null;
      const edit = split(block, time, this.times(block), this.studio.window);
      if (!edit) this.studio.say("Put the playhead inside the stretch to split it there.", { kind: "note" });
      return edit;
    });
  }

  async duplicate() {
    /** @type {string[]} */
    let ids = [];
    const done = await this.#editGroup((group) => {
      if (group.length === 0) return null;
      const copy = copyGroup(this.piece, group, this.studio.window);
      ({ ids } = copy);
      return copy.edit;
    });
    if (!done) return;
    const [from, block] = [ids[0], ids[ids.length - 1]];
    this.studio.store.set({ selection: ids.length > 1 ? { block, from } : { block } });
  }

  mirror() {
    return this.#editGroup((group) => together(group.map(({ id }) => ({ edit: "mirror", block: id })), "mirror"));
  }

  /** Delete the stretch, or discard or restore the insertion. */
  remove() {
    const { selection } = this.studio.store;
    return this.#inTurn(async () => {
      const { block, seam } = selected(this.piece, selection) ?? {};
      if (seam && seam.alternatives.length > 0) await this.#send(discard(seam));
      if (!block) return;
      const group = groupOf(this.piece, selection);
      const at = this.piece.blocks.indexOf(group[0]);
      const next = this.piece.blocks[at + group.length] ?? this.piece.blocks[at - 1];
      const done = await this.#send(together(group.map(({ id }) => ({ edit: "delete", block: id })), "delete"));
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
    this.show(zoomed(this.sight, this.piece, factor, x));
  }

  zoomIn() {
    this.zoom(ZOOM_RATIO, middleOf(this.sight, this.time));
  }

  zoomOut() {
    this.zoom(1 / ZOOM_RATIO, middleOf(this.sight, this.time));
  }

  fit() {
    const { seconds, blocks } = this.piece;
    this.show({ scale: fitting(Math.max(seconds, castOf(this.studio).seconds), this.sight.width, blocks.length), left: 0, fits: true });
  }

  /** Scroll a stretch of time into view. */
  reveal(at, seconds) {
    this.show(revealing(this.sight, at, seconds));
  }
}
