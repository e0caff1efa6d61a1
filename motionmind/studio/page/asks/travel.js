/** The path of an insertion as fields: its points, to add, move and remove, and where the body faces at its end. */

import { html } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { MAX_POINTS, millimetre } from "./asked.js";

const AXES = [
  ["left", "cm to the left of the first posture"],
  ["ahead", "cm ahead of the first posture"],
];

/**
 * @param {{travel: import("./asked.js").Travel | null, locked: boolean,
 *   onChange: (make: (travel: import("./asked.js").Travel | null) => import("./asked.js").Travel | null) => unknown}} props
 */
export function TravelFields({ travel, locked, onChange }) {
  const points = travel?.points ?? [];
  const change = (/** @type {(points: [number, number][]) => [number, number][]} */ make) =>
    onChange((now) => {
      const made = make(now?.points ?? []);
      return made.length > 0 ? { points: made, facing: now?.facing ?? null } : null;
    });
  const add = () =>
    change((now) => {
      const [x, z] = now.at(-1) ?? [0, 0.5];
      return [...now, [x, millimetre(z + 0.5)]];
    });
  return html`<div class="reaches stack" role="group" aria-label="Path over the floor">
    ${points.map((point, i) => {
      const name = i === points.length - 1 ? "End" : `Point ${i + 1}`;
      return html`<div key=${i} class="row places" role="group" aria-label=${name}>
        <span class="grow">${name}</span>
        ${AXES.map(
          ([axis, words], k) => html`<label title=${words}>${axis}
            <${NumberField} step="5" value=${Math.round(100 * point[k])} disabled=${locked} aria-label=${`${name}: ${words}`}
              data-testid=${`travel-${i + 1}-${axis}`}
              use=${(/** @type {number} */ given) => {
                const metres = millimetre(Math.min(Math.max(given / 100, -100), 100));
                change((now) => now.map((one, at) => (at === i ? /** @type {[number, number]} */ (one.map((old, j) => (j === k ? metres : old))) : one)));
                return Math.round(100 * metres);
              }}
            /></label>`,
        )}
        <span class="hint">cm</span>
        <button class="button" disabled=${locked} aria-label=${`Remove ${name.toLowerCase()}`} data-testid=${`travel-${i + 1}-remove`}
          onClick=${() => change((now) => now.filter((_, at) => at !== i))}>Remove</button>
      </div>`;
    })}
    <div class="row">
      <button class="button" data-testid="travel-add" disabled=${locked || points.length >= MAX_POINTS} onClick=${add}>Add a point</button>
      ${
        travel &&
        html`<label class="row">faces
            <${NumberField} min="-360" max="360" step="5" placeholder="as it does" value=${travel.facing ?? ""} disabled=${locked}
              aria-label="Where the body faces at the end, degrees to the left" data-testid="travel-facing" nullable
              use=${(/** @type {number | null} */ given) => {
                const facing = given === null ? null : Math.min(Math.max(given, -360), 360);
                onChange((now) => now && { ...now, facing });
                return facing;
              }}
            />°</label>
          <button class="button" disabled=${locked} data-testid="travel-clear" onClick=${() => onChange(() => null)}>Remove the path</button>`
      }
    </div>
  </div>`;
}
