/** The look-only link: copied to pass it on, or replaced by another. */

import { html, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { icon } from "./icons.js";

/** A button that opens the sheet. @param {{studio: any}} props */
export function Share({ studio }) {
  const [address, setAddress] = useState("");
  const open = () => studio.act(async () => setAddress((await studio.api.get("/api/link")).address));
  return html`<button class="button quiet" data-testid="share" aria-haspopup="dialog" title="Let others look and comment" onClick=${open}>
      ${icon("share")}<span class="word">Share</span>
    </button>
    ${address && html`<${Sheet} studio=${studio} address=${address} take=${setAddress} />`}`;
}

/** @param {{studio: any, address: string, take: (address: string) => void}} props */
function Sheet({ studio, address, take }) {
  const dialog = useRef(/** @type {any} */ (null));
  const field = useRef(/** @type {any} */ (null));
  const [words, say] = useState("");
  useLayoutEffect(() => {
    dialog.current.showModal();
    field.current.select();
  }, []);
  const copy = async () => {
    field.current.select();
    // A page of another computer has no clipboard but this old way to it.
    const copied = await (navigator.clipboard?.writeText(address) ?? Promise.reject()).then(
      () => true,
      () => document.execCommand("copy"),
    );
    say(copied ? "Copied." : "Press Ctrl+C to copy the link.");
  };
  const replace = () =>
    studio.once("a new link", async () => {
      take((await studio.api.post("/api/link")).address);
      say("This is the new link. The old one has ended.");
    });
  return html`<dialog ref=${dialog} class="sheet share" data-testid="share-sheet" aria-label="Let others look" onClose=${() => take("")}>
    <form method="dialog" class="row">
      <h2 class="grow">Let others look</h2>
      <button class="button">Close</button>
    </form>
    <div class="stack">
      <p>People who open this link see the piece and its notes, and can comment, but not change anything. It lasts until you make a new one.</p>
      <div class="row">
        <input ref=${field} class="field grow" readonly aria-label="Link" data-testid="share-link" value=${address} />
        <button class="button primary" data-testid="share-copy" onClick=${copy}>Copy</button>
      </div>
      <div class="row">
        <button class="button" data-testid="share-new" onClick=${replace}>New link</button>
        <p class="hint grow" role="status">${words || "A new link ends the old one at once."}</p>
      </div>
    </div>
  </dialog>`;
}
