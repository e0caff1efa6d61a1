/** Write the piece, or the selected stretch, as a score. */

import { html, useMemo, useState } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { perStudio, useChange } from "../shell/hooks.js";
import { useStore } from "../store.js";
import { Score } from "./score.js";

const [TIGHTEST, WIDEST, USUAL] = [1, 90, 10]; // degrees

export const scoreOf = perStudio((studio) => new Score(studio));

/** @param {{studio: any}} props */
export function AsScore({ studio }) {
  const score = useMemo(() => scoreOf(studio), [studio]);
  useChange(score, () => score.version);
  const [tolerance, setTolerance] = useState(USUAL);
  const blocks = useStore(studio, ({ state }) => state?.piece.blocks) ?? [];
  const selection = useStore(studio, (store) => store.selection);
  const block = blocks.find(({ id }) => id === selection?.block);
  const write = (/** @type {any} */ one) => studio.once("score", () => score.write(one, tolerance));
  const busy = score.busy === "writing";
  return html`<section class="stack scores" aria-label="As a score" aria-busy=${busy}>
    <h3>As a score</h3>
    <p class="hint">${blocks.length ? "Read the movement as text, and change it there." : "Put movement on the time line to read it as text."}</p>
    <label class="row"><span class="grow">Deviation, degrees</span>
      <${NumberField} data-testid="score-tolerance" min=${TIGHTEST} max=${WIDEST} step="any" inputmode="decimal" value=${tolerance}
        use=${(/** @type {number} */ given) => {
          const used = Math.min(Math.max(given, TIGHTEST), WIDEST);
          setTolerance(used);
          return used;
        }} /></label>
    <div class="row">
      <button class="button" data-testid="score-piece" disabled=${busy || blocks.length === 0} onClick=${() => write(undefined)}>The piece</button>
      <button class="button" data-testid="score-block" disabled=${busy || !block} onClick=${() => write(block)}>The selected stretch</button>
    </div>
    ${busy && html`<p class="hint" role="status">Writing the score…</p>`}
  </section>`;
}
