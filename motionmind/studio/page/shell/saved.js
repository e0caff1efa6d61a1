/** When the piece was saved: after every edit. */

import { html } from "../vendor/htm-preact-standalone.js";

/** @param {{state: any}} props */
export function Saved({ state }) {
  const at = new Date(1000 * state.saved);
  const day = at.toDateString() === new Date().toDateString() ? "" : `${at.toLocaleDateString()} `;
  return html`<span class="hint numbers saved" data-testid="saved" title="Every edit is saved at once, in ${state.file}">
    <span class="word">saved </span>${day}${at.toTimeString().slice(0, 8)}
  </span>`;
}
