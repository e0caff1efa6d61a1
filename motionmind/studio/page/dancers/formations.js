/** The changes of formation: when all go to which places, and how long they take. */

import { html } from "../vendor/htm-preact-standalone.js";
import { retimed } from "./entries.js";
import { field, placeFields } from "./panel.js";

const FORMATIONS = ["line", "circle", "V", "grid"];
const USUAL_COUNTS = 4;
const USUAL_SPACING_M = 1.5;

/** @param {{cast: any}} props */
export function Formations({ cast }) {
  const { changes } = cast.now;
  /** The first count from the playhead on at which nobody changes the formation. */
  const free = () => {
    const at = Math.max(Math.round(cast.countAt(cast.studio.viewer.player.time)), 1);
    const last = changes[changes.length - 1];
    return last ? Math.max(at, last.at + last.counts) : at;
  };
  const add = () =>
    cast.form((/** @type {any[]} */ all) => [...all, { at: free(), counts: USUAL_COUNTS, formation: "line", spacing: USUAL_SPACING_M, places: {} }]);
  return html`<section class="stack" aria-label="Changes of formation">
    <h3>Formations</h3>
    <ul class="stack">
      ${changes.map((/** @type {any} */ change, /** @type {number} */ i) => html`<${Change} key=${i} cast=${cast} change=${change} number=${i} />`)}
    </ul>
    <button class="button" data-testid="add-formation" onClick=${add}>Change the formation</button>
    <p class="hint">At the playhead, or after the last change. The piece waits, and feet slide.</p>
  </section>`;
}

/** @param {{cast: any, change: import("./cast.js").Change, number: number}} props */
function Change({ cast, change, number }) {
  const test = `change-${number}`;
  /** @param {object} fields */
  const put = (fields) => cast.form((/** @type {any[]} */ all) => all.map((one, i) => (i === number ? { ...one, ...fields } : one)));
  const choose = (/** @type {string} */ formation) => {
    if (formation !== "places") return put({ formation, places: {} });
    const places = Object.fromEntries(cast.now.dancers.map((/** @type {any} */ { id, place }) => [id, place]));
    return put({ formation: null, places });
  };
  return html`<li class="card member" data-testid=${test}>
    <div class="row fields">
      <label class="number"><span class="hint">Formation</span>
        <select value=${change.formation ?? "places"} data-testid=${`${test}-formation`} onChange=${(/** @type {any} */ event) => choose(event.target.value)}>
          ${[...FORMATIONS, "places"].map((name) => html`<option value=${name}>${name === "places" ? "own places" : name}</option>`)}
        </select></label>
      ${field("At count", `${test}-at`, change.at, 1, 100_000, "any", (at) => cast.form((/** @type {any[]} */ all) => retimed(all, number, at)))}
      ${field("For counts", `${test}-counts`, change.counts, 0.1, 10_000, "any", (counts) => put({ counts }))}
      ${change.formation && field("Apart, m", `${test}-spacing`, change.spacing, 0.1, 100, 0.1, (spacing) => put({ spacing }))}
      <button class="button quiet" aria-label=${`Remove change ${number + 1}`} data-testid=${`${test}-remove`}
        onClick=${() => cast.form((/** @type {any[]} */ all) => all.filter((_, i) => i !== number))}>Remove</button>
    </div>
    ${
      !change.formation &&
      cast.now.dancers.map(
        (/** @type {any} */ { id, name, place }) => html`<fieldset class="row fields" key=${id}><legend class="hint">${name}</legend>
          ${placeFields(change.places[id] ?? place, `${test}-${id}`, (make) => cast.form((/** @type {any[]} */ all) => all.map((one, i) => (i === number ? { ...one, places: { ...one.places, [id]: make(one.places[id] ?? place) } } : one))))}</fieldset>`,
      )
    }
  </li>`;
}
