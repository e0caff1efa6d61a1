/** The dancers of the piece: add, place and hide them, change their formation, and read who comes too near. */

import { html, useEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { useChange } from "../shell/hooks.js";
import { castOf } from "./cast.js";
import { Formations } from "./formations.js";
import { Spots } from "./spots.js";

const MAX_PLACE_M = 1000;
const MAX_TURN_DEG = 3600;
const MAX_SHOWN_NEAR = 8; // pairs of dancers

/** @param {{studio: any}} props */
export function Panel({ studio }) {
  const cast = castOf(studio);
  useChange(cast, () => cast.version);
  const { dancers } = useChange(studio.store, () => cast.now);
  const empty = useChange(studio.store, () => !studio.store.state?.piece?.blocks.length);
  useEffect(() => {
    const spots = new Spots(cast);
    return () => spots.close();
  }, [cast]);
  return html`<div class="stack dancers" data-testid="dancers">
    <h2>Dancers</h2>
    ${empty && html`<p class="empty">The piece is empty. Put movement on the time line, and dancers dance it.</p>`}
    ${cast.error && html`<p class="said error" role="alert">${cast.error}</p>`}
    ${dancers.length > 0 && html`<${Near} cast=${cast} />`}
    <ul class="stack" aria-label="Dancers">
      ${dancers.map((/** @type {any} */ dancer, /** @type {number} */ i) => html`<${Member} key=${dancer.id} cast=${cast} dancer=${dancer} colour=${cast.data?.dancers[i]?.colour} />`)}
    </ul>
    ${!empty && html`<${Add} cast=${cast} />`}
    ${dancers.length > 0 && html`<${Formations} cast=${cast} />`}
    <${Open} studio=${studio} />
  </div>`;
}

/** Who comes nearer than an arm's length to whom; a click shows the moment. @param {{cast: any}} props */
function Near({ cast }) {
  const { near } = cast;
  if (near === null) return html`<p class="hint" role="status">Looking for dancers who come too near…</p>`;
  if (near.length === 0) return html`<p class="hint" role="status" data-testid="near-none">Nobody comes nearer than an arm's length.</p>`;
  return html`<section class="card near" data-testid="near" aria-label="Nearer than an arm's length">
    <h3 class="said warning"><span role="status">Nearer than an arm's length</span></h3>
    <ul>
      ${near.slice(0, MAX_SHOWN_NEAR).map(
        (/** @type {any} */ { names, metres, seconds, count }) => html`<li><button class="button quiet" title="Show this moment" onClick=${() => cast.seek(seconds)}>
          ${names.join(" and ")}: ${metres.toFixed(2)} m at count ${count.toFixed(1)}</button></li>`,
      )}
    </ul>
    ${near.length > MAX_SHOWN_NEAR && html`<p class="hint">and ${near.length - MAX_SHOWN_NEAR} more pairs</p>`}
  </section>`;
}

/** A dancer's fields. @param {{cast: any, dancer: import("./cast.js").Dancer, colour?: number[]}} props */
function Member({ cast, dancer, colour }) {
  const { id, name, place, facing, entry, mirrored, source } = dancer;
  const hidden = cast.hidden.has(id);
  const [written, write] = useState(/** @type {string | null} */ (null)); // other edits do not overwrite what is typed
  const change = (/** @type {object} */ fields) => cast.change(id, () => fields);
  return html`<li class="card member" data-testid=${`dancer-${id}`}>
    <div class="row">
      <i class="swatch" style=${{ background: colour ? `rgb(${colour.join()})` : "transparent" }}></i>
      <input class="field grow" aria-label="Name" maxlength="100" autocomplete="off" value=${written ?? name} data-testid=${`name-${id}`}
        onInput=${(/** @type {any} */ event) => write(event.target.value)}
        onChange=${async () => {
          if (written?.trim()) await change({ name: written.trim() });
          write(null); // it shows the name in use, if this one is refused
        }} />
      <button class="button" aria-pressed=${String(!hidden)} data-testid=${`shown-${id}`} title=${`Show or hide ${name} in the viewer`} onClick=${() => cast.toggle(id)}>
        ${hidden ? "Hidden" : "Shown"}</button>
      <button class="button quiet" aria-label=${`Remove ${name}`} data-testid=${`remove-${id}`}
        onClick=${() => cast.edit(() => ({ edit: "dismiss", dancer: id }))}>Remove</button>
    </div>
    <div class="row fields">
      ${field("Enters at count", `entry-${id}`, entry, 1, 100_000, "any", (value) => change({ entry: value }))}
      ${placeFields(place, `place-${id}`, (make) => cast.change(id, ({ place: now }) => ({ place: make(now) })))}
      ${field("Turned left, degrees", `facing-${id}`, facing, -MAX_TURN_DEG, MAX_TURN_DEG, 15, (value) => change({ facing: value }))}
      <label class="row"><input type="checkbox" checked=${mirrored} data-testid=${`mirrored-${id}`}
        onChange=${(/** @type {any} */ event) => change({ mirrored: event.target.checked })} /> mirrored</label>
    </div>
    ${source && html`<p class="hint">Dances a movement of its own, not the time line.</p>`}
  </li>`;
}

/** @param {{cast: any}} props */
function Add({ cast }) {
  const [canon, setCanon] = useState(8);
  const [mirrored, setMirrored] = useState(false);
  const [facing, setFacing] = useState(0);
  const [place, setPlace] = useState(/** @type {[number, number] | null} */ (null)); // beside the others
  const wanted = place ?? cast.freePlace;
  const add = (/** @type {Event} */ event) => {
    event.preventDefault();
    cast.studio.once("add a dancer", async () => {
      await cast.add({ canon, mirrored, facing, place: wanted });
      setPlace(null);
    });
  };
  return html`<form class="card member" onSubmit=${add} data-testid="add">
    <h3>Add a dancer</h3>
    <p class="hint">The same piece, later: in canon. Dancers count evenly by the tempo, not by the music's beats.</p>
    <div class="row fields">
      ${field("Counts later", "add-canon", canon, 0, 10_000, "any", setCanon)}
      ${placeFields(wanted, "add-place", (make) => setPlace(make(wanted)))}
      ${field("Turned left, degrees", "add-facing", facing, -MAX_TURN_DEG, MAX_TURN_DEG, 15, setFacing)}
      <label class="row"><input type="checkbox" checked=${mirrored} data-testid="add-mirrored"
        onChange=${(/** @type {any} */ event) => setMirrored(event.target.checked)} /> mirrored</label>
      <button class="button primary" data-testid="add-dancer">Add a dancer</button>
    </div>
  </form>`;
}

/** Open an ensemble's file. @param {{studio: any}} props */
function Open({ studio }) {
  const chooser = useRef(/** @type {HTMLInputElement | null} */ (null));
  const [wrong, setWrong] = useState("");
  useEffect(() => setWrong(""), [studio]);
  const open = async (/** @type {File | undefined} */ file) => {
    if (!file) return;
    setWrong("");
    try {
      await studio.api.changed;
      studio.api.taken(await studio.api.upload(`/api/ensemble?window=${studio.window}`, file, file.name));
      castOf(studio).hidden.clear(); // they are others, with the same ids
      studio.viewer.back();
    } catch (error) {
      setWrong(error instanceof Error ? error.message : String(error));
    }
  };
  return html`<section class="card member">
    <h3>Open an ensemble</h3>
    <p class="hint">A TOML file. Its piece replaces the time line; undo brings that back. Upload its movement first.</p>
    <input ref=${chooser} type="file" hidden accept=".toml" aria-label="Ensemble" data-testid="choose-ensemble"
      onChange=${(/** @type {any} */ event) => {
        open(event.target.files[0]);
        event.target.value = "";
      }} />
    <button class="button" data-testid="open-ensemble" onClick=${() => chooser.current?.click()}>Choose a file</button>
    ${wrong && html`<p class="said error" role="alert" data-testid="ensemble-error">${wrong}</p>`}
  </section>`;
}

/**
 * A field for a number.
 * @param {string} label @param {string} test @param {number} value @param {number} min @param {number} max
 * @param {number | string} step @param {(value: number) => void} use
 */
export function field(label, test, value, min, max, step, use) {
  return html`<label class="number"><span class="hint">${label}</span>
    <${NumberField} value=${Math.round(value * 1000) / 1000} min=${min} max=${max} step=${step} data-testid=${test}
      use=${(/** @type {number} */ given) => {
        const next = Math.min(Math.max(given, min), max);
        use(next);
        return next;
      }} /></label>`;
}

/**
 * Fields for a place on the floor.
 * @param {number[]} place @param {string} test
 * @param {(make: (now: number[]) => [number, number]) => void} use gets the change of the place as it is then
 */
export function placeFields([x, z], test, use) {
  return html`${field("To stage left, m", `${test}-x`, x, -MAX_PLACE_M, MAX_PLACE_M, 0.1, (value) => use(([, now]) => [value, now]))}
    ${field("Downstage, m", `${test}-z`, z, -MAX_PLACE_M, MAX_PLACE_M, 0.1, (value) => use(([now]) => [now, value]))}`;
}
