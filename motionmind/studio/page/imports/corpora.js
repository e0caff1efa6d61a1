/** The list of corpora: browse, use for the piece, delete. */

import { html, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { movement } from "../movements.js";
import { thumbnail } from "../places.js";
import { useChange } from "../shell/hooks.js";

/** @param {{studio: any, imports: import("./imports.js").Imports}} props */
export function Corpora({ studio, imports }) {
  const used = useChange(studio.store, () => studio.store.state?.corpus);
  const [sheet, setSheet] = useState(/** @type {any} */ (null));
  const [deleting, setDeleting] = useState("");
  const failed = (/** @type {Error} */ error) => studio.say(error.message, { kind: "error" });
  const look = (/** @type {string} */ name) => imports.sheet(name).then(setSheet, failed);
  const remove = (/** @type {string} */ name) => {
    setDeleting("");
    imports.delete(name).then(() => studio.say(`Deleted ${name}.`), failed);
  };
  return html`<section class="stack corpora" aria-label="Corpora">
    <h3>Corpora</h3>
    <ul class="stack">
      ${imports.corpora.map(
        (corpus) => html`<li key=${corpus.name} class="card corpus" data-testid="corpus-${corpus.name}">
          <div class="row"><strong class="grow cut">${corpus.name}</strong>
            <span class="pale">${corpus.name === used ? "used for this piece" : corpus.own ? "your own" : ""}</span></div>
          ${corpus.title && html`<p class="hint">${corpus.title}</p>`}
          ${corpus.error && html`<p class="said error">${corpus.error}</p>`}
          <div class="row">
            <button class="button" data-testid="sheet-${corpus.name}" disabled=${Boolean(corpus.error)} onClick=${() => look(corpus.name)}>Browse</button>
            ${corpus.name !== used &&
            html`<button class="button quiet" data-testid="use-${corpus.name}" disabled=${Boolean(corpus.error)}
              onClick=${() => studio.api.edit({ edit: "corpus", name: corpus.name }).catch(failed)}>Use</button>`}
            ${corpus.own &&
            corpus.name !== used &&
            html`<button class="button quiet" data-testid="delete-${corpus.name}" onClick=${() => setDeleting(corpus.name)}>Delete</button>`}
          </div>
        </li>`,
      )}
    </ul>
    ${sheet && html`<${Sheet} studio=${studio} sheet=${sheet} onClose=${() => setSheet(null)} />`}
    ${deleting &&
    html`<${Modal} label="Delete ${deleting}" onClose=${() => setDeleting("")}>
      <div class="stack"><h2>Delete ${deleting}?</h2>
        <p>This cannot be undone. The files that it was learned from stay.</p>
        <div class="row"><button class="button primary" data-testid="delete-sure" onClick=${() => remove(deleting)}>Delete</button>
          <button class="button" data-testid="delete-not" onClick=${() => setDeleting("")}>Keep it</button></div></div>
    </${Modal}>`}
  </section>`;
}

/** @param {{studio: any, sheet: any, onClose: () => void}} props */
function Sheet({ studio, sheet, onClose }) {
  const play = async (/** @type {any} */ clip) => {
    onClose();
    studio.viewer.show(await movement(studio.api, clip.key), { title: clip.title, play: true });
  };
  return html`<${Modal} label="The clips of ${sheet.name}" wide onClose=${onClose}>
    <div class="stack" data-testid="sheet">
      <header class="row"><h2 class="grow">${sheet.name}</h2>
        <button class="button" data-testid="close-sheet" onClick=${onClose}>Close</button></header>
      <p class="hint">${[sheet.title, `${sheet.clips.length} clips, ${sheet.postures} postures, ${sheet.body}`, sheet.author, sheet.licence]
        .filter(Boolean)
        .join(" · ")}</p>
      <ul class="sheet-clips">${sheet.clips.map(
        (/** @type {any} */ clip) => html`<li key=${clip.key} class="card">
          <button class="strip-of" title="Play ${clip.title}" aria-label="Play ${clip.title}, ${clip.seconds} seconds" onClick=${() => play(clip)}>
            ${clip.pictures.map(
              (/** @type {number} */ frame) =>
                html`<img key=${frame} loading="lazy" alt="" width="64" height="72" src=${thumbnail(clip.key, frame, 72)} />`,
            )}
          </button>
          <div class="row"><strong class="grow cut">${clip.title}</strong><span class="pale numbers">${clip.seconds.toFixed(1)} s</span></div>
          ${clip.about && html`<p class="hint cut" title=${clip.about}>${clip.about}</p>`}
        </li>`,
      )}</ul>
    </div>
  </${Modal}>`;
}

/** A dialog over the page; Escape closes it. @param {{label: string, wide?: boolean, onClose: () => void, children?: any}} props */
function Modal({ label, wide = false, onClose, children }) {
  const dialog = useRef(/** @type {HTMLDialogElement | null} */ (null));
  useLayoutEffect(() => dialog.current?.showModal(), []);
  return html`<dialog ref=${dialog} class=${wide ? "wide" : ""} aria-label=${label} onClose=${onClose}>${children}</dialog>`;
}
