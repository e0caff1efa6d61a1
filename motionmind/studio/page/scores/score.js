/** The piece, or a stretch of it, as a score that can be edited. It knows no views. */

import { choicesAt } from "../timeline/groups.js";
import { newId } from "../timeline/items.js";
import { anchorOf } from "../timeline/notes.js";

const SLACK_S = 1e-3;
const END_S = 0.1; // a score may end a frame before its movement
const STALE = "The piece has changed: write it as a score again.";
const FIELDS = ["id", "source", "first", "last", "mirrored", "hold", "pace", "repeats"];
const MAX_MOVED_NOTES = 1990; // in one edit, besides its blocks and the wishes at two seams
const WHOLE = { mirrored: false, hold: 0, pace: 1, repeats: 1 };

/**
 * @typedef {import("../timeline/items.js").Block} Block
 * @typedef {{text: string, lines: number[], calls: number[], times: number[]}} Version of the text: the line, the clip's
 *   line and the time of each posture
 */

/** @type {Version} */
const NONE = { text: "", lines: [], calls: [], times: [] };

/** Fires "change" on any change. */
export class Score extends EventTarget {
  job = ""; // that wrote the score; "" if none is open
  text = ""; // as edited
  error = "";
  wrong = 0; // the line with the error; 0 if none is known
  /** @type {"" | "writing" | "composing"} */
  busy = "";
  of = ""; // title of the stretch; "" for the piece
  version = 0;
  /** @type {Map<string, Version>} the versions of the text by the blocks that they are */
  #versions = new Map();
  #at = ""; // the present one
  #whole = true;
  /** @type {any} that was followed last */
  #piece = null;

  /** @param {any} studio */
  constructor({ api, store, window }) {
    super();
    this.api = api;
    this.store = store;
    this.window = window;
    store.addEventListener("change", () => store.state?.piece !== this.#piece && this.#follow());
  }

  get isOpen() {
    return this.job !== "";
  }

  /** Whether the text has changes that are not in the piece. */
  get isDraft() {
    return this.text !== this.#now?.text;
  }

  /** @returns {Version | undefined} */
  get #now() {
    return this.#versions.get(this.#at);
  }

  /** @returns {Block[]} */
  get #blocks() {
    return this.store.state?.piece.blocks ?? [];
  }

  /** Write the piece, or a block of it, as a score. @param {Block | undefined} block @param {number} tolerance degrees */
  async write(block, tolerance) {
    this.#set({ busy: "writing" });
    try {
      const at = block ? keyOf([block]) : this.#pieceKey;
      const { job } = await this.api.post("/api/score", { block: block?.id ?? null, tolerance });
      const { text, lines, calls, times } = await this.#result(job);
      this.#versions = new Map([[at, { text, lines, calls, times }]]);
      this.#at = at;
      this.#whole = !block;
      this.#set({ job, text, error: "", wrong: 0, of: block?.title ?? "" });
      this.#follow();
    } finally {
      this.#set({ busy: "" });
    }
  }

  /** @param {string} text */
  edit(text) {
    this.#set({ text });
  }

  close() {
    this.#versions.clear();
    this.#set({ job: "", text: "", error: "", wrong: 0 });
  }

  /** Make the text the piece, or the stretch. */
  async apply() {
    const { text, job } = this;
    if (this.busy || !this.isDraft || this.error === STALE) return;
    this.#set({ busy: "composing", error: "", wrong: 0 });
    let at = "";
    try {
      const { key, frames, lines, calls, times, error } = await this.api.post("/api/score/compose", { job, text });
      if (error) throw new Error(error);
      const found = this.#found();
      if (!found) throw new Error(STALE);
      if (bare(text) === bare(this.#versions.get(found)?.text ?? "")) {
        this.#versions.set(found, { text, lines, calls, times });
        return; // it is the same movement
      }
      const block = { id: newId(this.window), source: key, first: 0, last: frames - 1, ...WHOLE };
      at = keyOf([block]);
      this.#versions.set(at, { text, lines, calls, times });
      await this.api.edit({ edit: "several", edits: this.#edits(found, block, times), words: "edit the score" });
    } catch (error) {
      this.#versions.delete(at);
      const { message } = /** @type {Error} */ (error);
      this.#set({ error: message, wrong: Number(/^score:(\d+):/.exec(message)?.[1] ?? 0) });
    } finally {
      this.#set({ busy: "" });
      this.#follow();
    }
  }

  /**
   * The edits that put a block in place of the version of a key; notes keep their times, and seams their wishes.
   * @param {string} found @param {any} block @param {number[]} times of its movement
   */
  #edits(found, block, times) {
    const { notes, seams } = this.store.state.piece;
    const old = this.#whole ? undefined : this.#blocks.find((one) => keyOf([one]) === found);
    const blocks = old ? this.#blocks.map((one) => (one === old ? block : only(one))) : [block];
    const placed = { ...block, at: old?.at ?? 0 };
    const moved = notes.filter((/** @type {any} */ note) => !old || note.block === old.id).slice(0, MAX_MOVED_NOTES);
    const noted = moved.map((/** @type {any} */ { id, kind, text, author, at }) => {
      const anchor = anchorOf({ blocks: [placed] }, Math.min(at, placed.at + times[times.length - 1]), () => Float64Array.from(times));
      return { edit: "note", note: { id, kind, text, author, ...anchor } };
    });
    const renamed = (/** @type {string} */ id) => (id === old?.id ? block.id : id);
    const beside = seams.filter((/** @type {any} */ { left, right }) => old && left !== right && [left, right].includes(old.id));
    const wishes = beside.flatMap((/** @type {any} */ seam) => choicesAt({ ...seam, left: renamed(seam.left), right: renamed(seam.right), chosen: 1 }));
    return [{ edit: "arrange", blocks, about: { words: "edit the score" } }, ...noted, ...wishes];
  }

  /** The lines of the posture at a time of the piece; null outside of the score. @param {number} time */
  linesAt(time) {
    const { lines, calls, times } = this.#now ?? NONE;
    const own = time - this.#start;
    if (this.isDraft || this.error === STALE || own < -SLACK_S || own > times[times.length - 1] + END_S) return null;
    const index = times.findLastIndex((at) => at <= own + SLACK_S);
    return index < 0 ? null : { line: lines[index], call: calls[index] };
  }

  /** The time in the piece of a line, the one nearest to `time`; null if it has none. @param {number} line @param {number} time */
  timeOf(line, time) {
    const { lines, calls, times } = this.#now ?? NONE;
    if (this.isDraft || this.error === STALE) return null;
    const called = calls.indexOf(line);
    const all = times.filter((_, i) => lines[i] === line).map((at) => at + this.#start);
    if (all.length === 0) return called < 0 ? null : times[called] + this.#start;
    return all.reduce((best, at) => (Math.abs(at - time) < Math.abs(best - time) ? at : best));
  }

  get #start() {
    return this.#whole ? 0 : (this.#blocks.find((one) => keyOf([one]) === this.#at)?.at ?? 0);
  }

  /** The piece's blocks and insertions as a key: an insertion that is found later shifts the times. */
  get #pieceKey() {
    const parts = /** @type {any[]} */ (this.store.state?.piece.parts ?? []);
    return [keyOf(this.#blocks), ...parts.filter(({ inserted }) => inserted).map(({ key }) => key)].join(" ");
  }

  /** The key of the version that is in the piece; "" if none is. */
  #found() {
    const keys = this.#whole ? [this.#pieceKey] : this.#blocks.map((one) => keyOf([one]));
    return keys.find((key) => this.#versions.has(key)) ?? "";
  }

  /** Follow the piece: an undone change of the text is undone here, too. */
  #follow() {
    this.#piece = this.store.state?.piece;
    if (!this.isOpen) return;
    const at = this.#found();
    const stale = !at && this.busy !== "composing" ? STALE : "";
    if (at && at !== this.#at) {
      const kept = this.isDraft && this.busy !== "composing";
      this.#at = at;
      if (!kept) this.text = this.#now?.text ?? "";
      this.#set({ error: "", wrong: 0 });
    } else if (stale || this.error === STALE) this.#set({ error: stale });
    else this.#set({}); // blocks may have moved
  }

  /** Wait for a job's result. @param {string} id @returns {Promise<Version>} */
  #result(id) {
    return new Promise((resolve, reject) => {
      const look = () => {
        const job = this.store.jobs.get(id);
        if (!job || job.state === "waiting" || job.state === "running") return;
        this.store.removeEventListener("change", look);
        if (job.state === "done") resolve(job.result);
        else reject(new Error(job.words || "The score was not written."));
      };
      this.store.addEventListener("change", look);
      look();
    });
  }

  /** @param {object} fields */
  #set(fields) {
    Object.assign(this, fields);
    this.version += 1;
    this.dispatchEvent(new Event("change"));
  }
}

/** A text without its comments and empty lines. @param {string} text */
function bare(text) {
  const lines = text.split("\n").map((line) => line.replace(/#.*/, "").replace(/\s+/g, " ").trimEnd());
  return lines.filter(Boolean).join("\n");
}

/** The fields of a block that an edit has. @param {Block} block */
function only(block) {
  return Object.fromEntries(FIELDS.map((name) => [name, block[name]]));
}

/** A text that tells blocks apart. @param {any[]} blocks */
function keyOf(blocks) {
  return JSON.stringify(blocks.map((block) => FIELDS.map((name) => block[name])));
}
