/** The time line below the viewer: stretches, seams, and wishes. */

import { html, useEffect, useMemo, useReducer, useState } from "../vendor/htm-preact-standalone.js";
import { castOf, NOBODY } from "../dancers/cast.js";
import { movement } from "../movements.js";
import { meterOf } from "../music/beats.js";
import { MusicSheet } from "../music/sheet.js";
import { thumbnail } from "../places.js";
import { useStore } from "../store.js";
import { Actions } from "./actions.js";
import { Composed, Movements } from "./composed.js";
import { EMPTY, selected } from "./items.js";
import { useChange, useKeys } from "../shell/hooks.js";
import { act, KEYS } from "./keys.js";
import { NoteSheet } from "./notes.js";
import { fitting } from "./scale.js";
import { Toolbar } from "./toolbar.js";
import { Tracks } from "./tracks.js";
import { WishSheet } from "./wishes.js";

const THUMBNAIL_HEIGHT_PX = 48;
/** Rows for the sheet of keys, without actions: the focused tracks handle these keys. */
const ROWS = KEYS.filter(([, , shown]) => shown).map(([, , shown, does]) => ({ shown: [shown], does, group: "Time line" }));
const LIMBS = /(wrist|hand|ankle|foot)$/;

export function Panel({ studio }) {
  const piece = useStore(studio, ({ state }) => state?.piece) ?? EMPTY;
  const selection = useStore(studio, (store) => store.selection);
  const [sight, show] = useReducer((old, change) => same(old, change), null, () => ({
    scale: 60,
    left: 0,
    width: 800,
    fits: true,
    sheet: false,
    note: "", // the id of the one that is written; "new" for another
    snaps: false,
    music: false, // whether its sheet is open
  }));
  const meter = useStore(studio, ({ state }) => meterOf(state));
  const does = useMemo(() => new Actions(studio, new Movements((key) => movement(studio.api, key)), show), [studio]);
  does.sight = sight;
  const joints = usePlayed(studio, does.movements, piece).filter((name) => LIMBS.test(name));
  const whole = useChange(castOf(studio), () => Math.max(piece.seconds, castOf(studio).seconds));
  useEffect(() => {
    if (sight.fits) show({ scale: fitting(whole, sight.width, piece.blocks.length), left: 0 });
  }, [whole, piece.blocks.length, sight.width, sight.fits]);
  const stopped = useStore(studio, (store) => store.stopped);
  useEffect(() => studio.keys.add(ROWS), [studio]);
  useKeys(studio, [
    { keys: ["n"], does: "write a note, marker or section", group: "Time line", act: () => piece.blocks.length > 0 && does.note() },
    { keys: ["["], does: "go to the note before", group: "Time line", act: () => does.toNote(-1) },
    { keys: ["]"], does: "go to the note after", group: "Time line", act: () => does.toNote(1) },
  ]);
  const seam = selected(piece, selection)?.seam;
  const note = piece.notes.find(({ id }) => id === sight.note);
  return html`<section
    class="timeline"
    data-testid="timeline"
    aria-label="Time line"
    onKeyDown=${(event) => {
      if (!event.defaultPrevented && !kept(event)) act(event, KEYS, does);
    }}
  >
    <${Toolbar}
      does=${does}
      piece=${piece}
      selection=${selection}
      meter=${meter}
      snaps=${sight.snaps}
      stopped=${stopped}
      onStop=${(stop) => does.smooth(!stop)}
      sheet=${sight.sheet}
    />
    <${Tracks} does=${does} piece=${piece} whole=${whole} sight=${sight} selection=${selection} meter=${meter} thumbnail=${picture} />
    ${sight.sheet &&
    seam &&
    html`<${WishSheet}
      key=${`${seam.left} ${seam.right}`}
      does=${does}
      studio=${studio}
      seam=${seam}
      joints=${joints}
      thumbnail=${picture}
      onClose=${() => {
        show({ sheet: false });
        does.focused = true;
      }}
    />`}
    ${sight.music && !sight.sheet && !sight.note && html`<${MusicSheet} does=${does} />`}
    ${(note || sight.note === "new") &&
    html`<${NoteSheet}
      key=${sight.note}
      does=${does}
      note=${note}
      onClose=${() => {
        show({ note: "" });
        const opener = document.querySelector(note ? `[data-note="${note.id}"]` : "[data-testid=note]");
        /** @type {HTMLElement | null} */ (opener)?.focus();
      }}
    />`}
  </section>`;
}

/** Whether the focused element needs a key for itself. */
function kept({ key, target }) {
  if (target.closest("[role=slider]")) return key.length > 1; // the ruler, which needs no letters
  return target.closest("input, select, [role=dialog]") || (key === "Enter" && target.closest("button"));
}

/** Apply a change to the visible range; return the same object if nothing changes. */
function same(old, change) {
  return Object.entries(change).every(([name, value]) => old[name] === value) ? old : { ...old, ...change };
}

/**
 * Show the piece in the viewer as soon as its first movement has loaded, and again when all have.
 * Return the names of its joints; none until they are known.
 */
export function usePlayed(studio, movements, { parts }) {
  const cast = useStore(studio, ({ state }) => state?.cast) ?? NOBODY;
  const tempo = useStore(studio, ({ state }) => state?.tempo);
  const told = JSON.stringify([parts, cast, cast.dancers.length && tempo]);
  const [joints, setJoints] = useState([]);
  useEffect(() => {
    if (parts.length === 0) {
      studio.viewer.clear();
      castOf(studio).clear();
      return undefined;
    }
    let stale = false;
    const shown = async () => {
      await Promise.all([movements.load(parts[0].key), studio.pictured()]);
      if (stale) return;
      const composed = new Composed(parts, movements, studio.store.state.title ?? "");
      setJoints(composed.joints);
      const played = await castOf(studio).gather(composed);
      if (stale) return;
      const { time } = studio.viewer.isHome ? studio.viewer.player : { time: 0 };
      studio.viewer.home(played, { time });
      await played.load();
      if (stale) return;
      movements.keep(played.keys);
      const now = studio.viewer.isHome ? studio.viewer.player.time : 0;
      studio.viewer.home(played, { time: now });
    };
    shown().catch((error) => studio.say(error.message, { kind: "error" }));
    return () => (stale = true);
  }, [told]);
  return joints;
}

/** A posture's picture. @param {string} key @param {number} frame */
function picture(key, frame) {
  return thumbnail(key, frame, THUMBNAIL_HEIGHT_PX);
}
