/** Notes, markers and named sections: their track, the sheet to write them, and where they are anchored. */

import { html, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { lastBefore } from "./composed.js";
import { newId } from "./items.js";
import { clock } from "./scale.js";

export const KINDS = { note: "Note", marker: "Marker", section: "Section" };
const SAME_TIME_S = 0.005;
const MIN_WIDTH_PX = 24;

/**
 * @typedef {{id: string, kind: "note"|"marker"|"section", text: string, block: string, frame: number, after: number,
 *   author: string, at: number, seconds: number}} Note
 */

/**
 * Where a note at `time` is anchored: a block, a frame of its movement, and seconds after that; null in an empty piece.
 * @param {{blocks: any[]}} piece @param {number} time @param {(block: any) => Float64Array | undefined} times of movements
 */
export function anchorOf({ blocks }, time, times) {
  if (blocks.length === 0) return null;
  const block = blocks[lastBefore(blocks, time + SAME_TIME_S, (/** @type {any} */ one) => one.at)];
  const own = Math.max(time - block.at, 0);
  const known = times(block);
  if (!known) return { block: block.id, frame: block.first, after: own };
  const begin = known[block.first];
  const frame = Math.min(Math.max(lastBefore(known, begin + own + SAME_TIME_S), block.first), block.last);
  return { block: block.id, frame, after: Math.max(own - (known[frame] - begin), 0) };
}

/** The note before or after the playhead; undefined if there is none. @param {Note[]} notes */
export function noteFrom(notes, time, by) {
  const rest = notes.filter(({ at }) => by * (at - time) > SAME_TIME_S);
  return by > 0 ? rest[0] : rest.at(-1);
}

/** A note in words. @param {Note} note */
function wordsOf({ kind, text, author, at }) {
  const words = author ? ` by ${author}: ${text}` : text && ` “${text}”`;
  return `${KINDS[kind]}${words}, at ${clock(at)} s`;
}

/** The notes on their track, one Tab stop. @param {{does: any, notes: Note[], sight: any}} props */
export function Notes({ does, notes, sight }) {
  const track = useRef(/** @type {any} */ (null));
  const [stop, setStop] = useState("");
  if (notes.length === 0) return null;
  const chosen = notes.some(({ id }) => id === stop) ? stop : notes[0].id;
  const key = (/** @type {KeyboardEvent} */ event) => {
    const at = notes.findIndex(({ id }) => id === /** @type {any} */ (event.target).dataset.note);
    if (at < 0) return;
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const removes = event.key === "Delete" || event.key === "Backspace";
    if ((!by && !removes) || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    const next = by ? notes[at + by] : (notes[at + 1] ?? notes[at - 1]);
    if (removes) does.edit({ edit: "erase", note: notes[at].id });
    if (!next) return;
    setStop(next.id);
    if (by) does.seek(next.at);
    does.reveal(next.at, 0);
    track.current.querySelector(`[data-note="${next.id}"]`)?.focus();
  };
  const flags = notes.filter(({ kind }) => kind !== "section");
  return html`<div class=${flags.length < notes.length ? "track notes sectioned" : "track notes"} role="group" aria-label="Notes, markers and sections" ref=${track} onKeyDown=${key}>
    ${notes.map((note) => {
      const words = wordsOf(note);
      const wide = note.kind === "section" && Math.max(note.seconds * sight.scale, MIN_WIDTH_PX);
      const next = flags[flags.indexOf(note) + 1];
      const room = !wide && next ? Math.max((next.at - note.at) * sight.scale - 2, MIN_WIDTH_PX) : 0;
      return html`<button
        key=${note.id}
        class=${`noted ${note.kind}${note.author ? " comment" : ""}`}
        data-note=${note.id}
        data-testid=${`note-${note.id}`}
        aria-label=${words}
        title=${words}
        tabindex=${note.id === chosen ? 0 : -1}
        style=${{ left: `${note.at * sight.scale}px`, width: wide ? `${wide}px` : "", maxWidth: room ? `min(16em, ${room}px)` : "" }}
        onClick=${() => {
          setStop(note.id);
          does.seek(note.at);
          does.show({ note: note.id });
        }}
      >
        ${note.kind === "marker" && html`<i aria-hidden="true">◆</i>`}${note.author && html`<b>${note.author}:</b>`}<span class="cut">${note.text}</span>
      </button>`;
    })}
  </div>`;
}

/** Write a note at the playhead, or change one. @param {{does: any, note?: Note, onClose: () => void}} props */
export function NoteSheet({ does, note, onClose }) {
  const element = useRef(/** @type {any} */ (null));
  const [kind, setKind] = useState(note?.kind ?? "note");
  const [text, setText] = useState(note?.text ?? "");
  const [time] = useState(does.time); // the piece may play on
  useLayoutEffect(() => {
    // A finger may only read it: no keyboard over the page.
    const read = note && matchMedia("(pointer: coarse)").matches;
    element.current.querySelector(read ? "[data-testid=note-close]" : "input").focus();
  }, []);
  const ready = kind === "marker" || text.trim() !== "";
  /** @param {object} change */
  const put = (change) => {
    const { id, block, frame, after, author } = note ?? { id: newId(does.studio.window), author: "" };
    return does.edit(() => {
      const anchor = note ? { block, frame, after } : anchorOf(does.piece, time, (one) => does.times(one));
      if (!anchor) does.studio.say("The piece is empty: there is no moment to note.", { kind: "note" });
      return anchor && { edit: "note", note: { id, kind, text: text.trim(), author, ...anchor, ...change } };
    });
  };
  const save = async (/** @type {Event} */ event) => {
    event.preventDefault();
    if (ready && (await put({}))) onClose();
  };
  const here = async () => {
    if (ready && (await put(anchorOf(does.piece, does.time, (one) => does.times(one)) ?? {}))) onClose();
  };
  const erase = () => {
    does.edit({ edit: "erase", note: note?.id });
    onClose();
  };
  const escape = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    onClose();
  };
  return html`<section
    class="wish-sheet note-sheet card"
    ref=${element}
    role="dialog"
    aria-label=${note ? "Change a note" : "Write a note"}
    data-testid="note-sheet"
    onKeyDown=${escape}
  ><form class="stack" onSubmit=${save}>
    <div class="row">
      <h3 class="grow">${note ? wordsOf(note) : `At ${clock(time)} s`}</h3>
      <button type="button" class="button quiet" onClick=${onClose} data-testid="note-close">Close</button>
    </div>
    <div class="row">
      <select class="field" aria-label="Kind" data-testid="note-kind" value=${kind} onChange=${(/** @type {any} */ event) => setKind(event.target.value)}>
        ${Object.entries(KINDS).map(([value, words]) => html`<option value=${value}>${words}</option>`)}
      </select>
      <input
        class="field grow"
        aria-label="Text"
        data-testid="note-text"
        maxlength="1000"
        autocomplete="off"
        value=${text}
        onInput=${(/** @type {any} */ event) => setText(event.target.value)}
      />
    </div>
    <div class="row">
      <button class="button strong" data-testid="note-save" disabled=${!ready}>Save</button>
      ${note && html`<button type="button" class="button" data-testid="note-here" disabled=${!ready} onClick=${here}>Move to the playhead</button>
        <button type="button" class="button" data-testid="note-erase" onClick=${erase}>Delete</button>`}
    </div>
  </form></section>`;
}
