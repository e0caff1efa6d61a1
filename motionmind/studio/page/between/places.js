/** Places for hands and feet on the way from A to B. */

import { html } from "../vendor/htm-preact-standalone.js";
import { Reaches } from "../asks/reaches.js";
import { useChange } from "../shell/hooks.js";
import { deskOf } from "./desk.js";

/** @param {{studio: any}} props */
export function Places({ studio }) {
  const desk = deskOf(studio);
  const reaches = useChange(desk, () => desk.reaches);
  const found = useChange(desk, () => desk.found);
  const chosen = useChange(desk, () => desk.chosen);
  const state = useChange(desk, () => desk.state);
  const words = useChange(desk, () => desk.words);
  useChange(studio.viewer, () => desk.looking, "show");
  const account = found[chosen]?.account;
  if (!account && reaches.length === 0) return null;
  const looking = desk.looking;
  return html`<details class="stack" open=${reaches.length > 0 || looking} data-testid="places">
    <summary class="hint">Places for hands and feet</summary>
    <div class="stack">
      ${!looking && html`<button class="button" data-testid="look" disabled=${!account} onClick=${() => desk.look()}>Set places in the viewer</button>`}
      ${looking &&
      html`<p class="hint" role="status" data-testid="reached">
        ${state === "searching" && !account ? "Searching…" : account ? [account.words, ...account.beyond].join("; ") : words}
      </p>`}
      <${Reaches} studio=${studio} reaches=${reaches} seconds=${account?.seconds ?? desk.scene?.end ?? 600}
        onChange=${(/** @type {import("../asks/asked.js").Change} */ change) => desk.reach(change(desk.reaches))} />
    </div>
  </details>`;
}
