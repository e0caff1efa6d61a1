/** The card of an uploaded file: its facts, open questions, and actions. */

import { html } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { bodyOf, doubtsOf, lengthOf, sizeOf } from "./words.js";

const UNITS = /** @type {[string, string][]} */ ([
  ["cm", "centimetres"],
  ["m", "metres"],
  ["mm", "millimetres"],
  ["dm", "decimetres"],
  ["in", "inches"],
  ["ft", "feet"],
  ["cmu", "CMU's unit"],
]);
const WITH_UNIT = ["bvh", "glb", "vrm", "vrma"];
const WITH_RATE = ["bvh", "amc", "npz"];
const MAX_LISTED = 40; // clips

/**
 * @param {{imports: import("./imports.js").Imports, file: import("./imports.js").Upload,
 *   onLook: (clip: number) => void, onPut: (clip: number) => void, onFail: (error: Error) => void}} props
 */
export function FileCard({ imports, file, onLook, onPut, onFail }) {
  const { facts, error, kind } = file;
  const choose = (/** @type {object} */ change) => imports.choose(file, change).catch(onFail);
  const again = imports.reading.has(file.id);
  return html`<li class="card file" data-testid="file" aria-busy=${again}>
    <header class="row">
      <strong class="grow cut" title=${file.name}>${file.name}</strong>
      <span class="pale numbers">${sizeOf(file.size)}</span>
      <button class="button quiet" data-testid="forget-file" aria-label="Remove ${file.name}"
        onClick=${() => imports.forget(file).catch(onFail)}>Remove</button>
    </header>
    ${error && html`<p class="said error" role="alert" data-testid="file-error">${error}</p>`}
    ${kind === "asf" && html`<p class="hint">The skeleton of .amc files, which are read with it.</p>`}
    ${facts &&
    html`<p data-testid="understood">${facts.clips.length === 1 ? `${lengthOf(facts.clips[0])}; ` : `${facts.clips.length} clips; `}${bodyOf(facts)}</p>
      ${doubtsOf(file).map(
        ([words, serious]) => html`<p class=${serious ? "said warning" : "hint"}>${serious ? "⚠ " : ""}${words}</p>`,
      )}
      ${again && html`<p class="hint" aria-live="polite">Reading again…</p>`}
      <${Questions} file=${file} choose=${choose} />
      <ul class="clips">${facts.clips.slice(0, MAX_LISTED).map(
        (clip, number) => html`<li class="row" key=${number}>
          ${facts.clips.length > 1 && html`<span class="grow cut" title=${lengthOf(clip)}>${clip.name}</span>`}
          <button class="button" data-testid="look" disabled=${again} onClick=${() => onLook(number)}>Watch</button>
          <button class="button" data-testid="put" disabled=${again} onClick=${() => onPut(number)}>Add to the time line</button>
        </li>`,
      )}</ul>
      <label class="check"><input type="checkbox" data-testid="learn-from" checked=${!imports.left.has(file.id)}
        onChange=${(/** @type {any} */ event) => imports.want(file.id, event.target.checked)} />Learn from it</label>`}
  </li>`;
}

/** Questions that the file leaves open. @param {{file: import("./imports.js").Upload, choose: (change: object) => void}} props */
function Questions({ file, choose }) {
  const { facts, choices, kind, skips } = file;
  if (!facts) return null;
  const [clip] = facts.clips;
  const posed = facts.clips.some((one) => one.posed_first);
  const chosen = choices.unit ?? "";
  const fps = choices.fps ?? (clip.fps && Number(clip.fps.toFixed(2)));
  return html`<div class="questions">
    ${WITH_UNIT.includes(kind) &&
    html`<label class="row"><span class="grow">Unit</span>
      <select data-testid="unit" value=${chosen} onChange=${(/** @type {any} */ event) => choose({ unit: event.target.value || null })}>
        <option value="">${facts.is_guessed ? `${nameOf(facts.unit)} (guessed)` : "as the file says"}</option>
        ${UNITS.map(([unit, words]) => html`<option value=${unit}>${words}</option>`)}
      </select></label>`}
    ${WITH_RATE.includes(kind) &&
    clip.fps !== null &&
    html`<label class="row"><span class="grow">Frames a second</span>
      <${NumberField} data-testid="fps" min="1" max="1000" step="any" inputmode="decimal"
        value=${fps}
        use=${(given) => {
          if (given < 1 || given > 1000) return fps;
          choose({ fps: given });
          return given;
        }} /></label>`}
    ${(posed || (skips?.[0] ?? 0) > 0) &&
    html`<label class="check"><input type="checkbox" data-testid="skip" checked=${(skips?.[0] ?? 0) > 0}
      onChange=${(/** @type {any} */ event) => choose({ skip: event.target.checked ? null : 0 })} />
      Skip the first frame: it looks like an added pose</label>`}
  </div>`;
}

/** @param {string} unit */
function nameOf(unit) {
  return UNITS.find(([name]) => name === unit)?.[1] ?? unit;
}
