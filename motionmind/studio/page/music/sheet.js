/** The sheet that chooses the music, and the buttons for it and for taps. */

import { html, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { MOST_S } from "../reference/shift.js";
import { NumberField } from "../shell/fields.js";
import { useChange, useKeys } from "../shell/hooks.js";
import { useStore } from "../store.js";
import { musicOf, nameOf } from "./music.js";
import { tapsOf } from "./taps.js";

const NOTE = "M6 12.500a2 2 0 1 1-1-1.700V3l8-1.500v9.500a2 2 0 1 1-1-1.700";

/** Open the sheet; tap the tempo. @param {{does: any}} props */
export function MusicButtons({ does }) {
  const { studio } = does;
  const music = musicOf(studio);
  const taps = tapsOf(studio);
  const count = useChange(taps, () => taps.count);
  const tap = (/** @type {Event} */ event) => taps.tap(event.timeStamp, music.sound);
  useKeys(studio, [
    {
      keys: ["j"],
      does: "tap the tempo, four times or more; while the music plays, its beats follow",
      group: "Time line",
      act: (event) => (event.repeat ? undefined : tap(event)),
    },
  ]);
  return html`<button
      class="button tap numbers"
      data-testid="tap"
      title="Tap the tempo (J)"
      aria-label="Tap the tempo (J)"
      onPointerDown=${(/** @type {PointerEvent} */ event) => event.button === 0 && tap(event)}
      onClick=${(/** @type {MouseEvent} */ event) => event.detail === 0 && tap(event)}
    >
      ${count > 1 ? taps.tempo.toFixed(1) : count ? "1" : "Tap"}
    </button>
    <button
      class="button icon"
      data-testid="music"
      title="Music"
      aria-label="Music"
      aria-pressed=${String(does.sight.music)}
      onClick=${() => does.show({ music: !does.sight.music, sheet: false, note: "" })}
    >
      <svg viewBox="0 0 16 16" aria-hidden="true"><path d=${NOTE} /></svg>
    </button>`;
}

/** Choose music, and how the piece begins in it. @param {{does: any}} props */
export function MusicSheet({ does }) {
  const { studio } = does;
  const music = musicOf(studio);
  const kept = useStore(studio, ({ state }) => state?.music);
  const sounds = useChange(music, () => music.sound !== undefined);
  const audible = useChange(music, () => music.audible);
  const [path, setPath] = useState("");
  const [busy, setBusy] = useState(false);
  const element = useRef(/** @type {any} */ (null));
  useLayoutEffect(() => element.current.querySelector("[data-testid=music-path]").focus(), []);
  const open = (/** @type {string} */ chosen, /** @type {number | null} */ tempo) =>
    studio.once("open music", async () => {
      setBusy(true);
      try {
        await studio.api.changed;
        const { job } = await studio.api.post("/api/music", { window: studio.window, path: chosen, tempo });
        await over(studio.store, job);
        await studio.store.load(); // which an event may yet announce
        setPath("");
      } finally {
        setBusy(false);
      }
    });
  const begin = (/** @type {number} */ begins) => does.edit(() => ({ edit: "music", ...music.kept, begins }));
  const close = () => {
    does.show({ music: false });
    /** @type {HTMLElement | null} */ (document.querySelector("[data-testid=music]"))?.focus();
  };
  const escape = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    close();
  };
  const one = kept?.beats[kept.first];
  return html`<section class="wish-sheet music-sheet card stack" ref=${element} role="dialog" aria-label="Music" data-testid="music-sheet" onKeyDown=${escape}>
    <div class="row">
      <h3 class="grow cut" title=${kept?.path}>${kept?.path ? nameOf(kept.path) : "Music"}</h3>
      <button class="button quiet" data-testid="music-close" onClick=${close}>Close</button>
    </div>
    ${
      kept?.path &&
      html`<div class="row">
          <label class="row">Starts at
            <${NumberField} min=${-MOST_S} max=${MOST_S} step="0.01" value=${Number(kept.begins.toFixed(3))} data-testid="music-begins"
              aria-label="Time of the music at the piece's start, seconds" use=${(/** @type {number} */ given) => {
                const begins = Math.min(Math.max(given, -MOST_S), MOST_S);
                begin(begins);
                return begins;
              }} /> s
          </label>
          <button class="button" data-testid="music-one" disabled=${one === undefined || one === kept.begins} onClick=${() => begin(one)}>Start at count 1</button>
        </div>
        <div class="row">
          <button class="button" data-testid="music-beats" disabled=${busy} title="Find the beats near this tempo"
            onClick=${() => open(kept.path, studio.store.state.tempo)}>Find the beats</button>
          <button class="button" data-testid="music-sound" aria-pressed=${String(audible)} disabled=${!sounds} onClick=${() => music.sound?.toggle()}>Sound</button>
          <button class="button" data-testid="music-remove" onClick=${() => does.edit({ edit: "music" })}>Remove</button>
        </div>`
    }
    <form class="row" onSubmit=${(/** @type {Event} */ event) => {
      event.preventDefault();
      open(path.trim(), null);
    }}>
      <input class="field grow" aria-label="Path of the music" placeholder="Path, such as ~/song.mp3" data-testid="music-path" value=${path}
        autocomplete="off" spellcheck="false" onInput=${(/** @type {any} */ event) => setPath(event.target.value)} />
      <button class="button" data-testid="music-open" disabled=${busy || !path.trim()}>Open</button>
    </form>
    <p class="hint" role="status">${busy ? "Listening for the beats…" : "WAV, FLAC, OGG, MP3; or beats alone: TXT, MIDI. It stays on this computer, except in exports."}</p>
  </section>`;
}

/** Wait until a job is done; throw an Error if it fails. @param {import("../store.js").Store} store @param {string} job */
function over(store, job) {
  return new Promise((done, failed) => {
    const look = () => {
      const { state, words } = store.jobs.get(job) ?? {};
      if (!["done", "failed", "cancelled"].includes(state)) return;
      store.removeEventListener("change", look);
      if (state === "done") done(undefined);
      else failed(new Error(words));
    };
    store.addEventListener("change", look);
    look();
  });
}
