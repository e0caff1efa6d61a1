/** Save a sheet to print: postures at counts or at regular times, with sections and notes. */

import { html, useState } from "../vendor/htm-preact-standalone.js";
import { useStore } from "../store.js";

/** How far apart postures may be, by the value of the field. */
const SPACINGS = {
  "1 counts": "every count",
  "2 counts": "every 2nd count",
  "4 counts": "every 4th count",
  "8 counts": "every eight",
  "0.5 seconds": "every half second",
  "1 seconds": "every second",
  "2 seconds": "every 2 seconds",
  "5 seconds": "every 5 seconds",
};

/** @param {{studio: any, Save: any}} props `Save` is a button that saves what the server makes at a path */
export function Sheet({ studio, Save }) {
  const [spacing, space] = useState("4 counts");
  const tempo = useStore(studio, ({ state }) => state?.tempo) ?? 120;
  const [every, unit] = spacing.split(" ");
  const query = () => new URLSearchParams({ every, unit, tempo: String(tempo) });
  return html`<section class="card way">
    <div>
      <h3>Print sheet</h3>
      <p class="hint">Postures on paper, with counts, sections and notes.</p>
      <select class="field" aria-label="Postures" data-testid="sheet-spacing" value=${spacing}
        onChange=${(/** @type {any} */ event) => space(event.target.value)}>
        ${Object.entries(SPACINGS).map(([value, words]) => html`<option value=${value}>${words}</option>`)}
      </select>
    </div>
    <div class="row">
      <${Save} studio=${studio} path=${() => `/api/sheet/pdf?${query()}`} testid="sheet-pdf" label="PDF" />
      <${Save} studio=${studio} path=${() => `/api/sheet/png?${query()}`} testid="sheet-png" label="PNG" />
    </div>
  </section>`;
}
