/** Places for hands and feet at given times, as fields: to add, move, time and remove them without a mouse. */

import { html, useState } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { limbName } from "../timeline/blocks.js";
import { askedOf, limbsOf, MAX_REACHES, millimetre, reachNow, within } from "./asked.js";

const AXES = [
  ["left", "cm to the left of the first posture"],
  ["up", "cm above the floor"],
  ["ahead", "cm ahead of the first posture"],
];

/**
 * @param {{studio: any, reaches: import("./asked.js").Reach[], seconds: number, locked?: boolean,
 *   onChange: (change: import("./asked.js").Change) => unknown}} props `seconds` is how long the insertion lasts
 */
export function Reaches({ studio, reaches, seconds, locked = false, onChange }) {
  const asked = askedOf(studio);
  const [joint, setJoint] = useState("");
  const limbs = asked ? limbsOf(studio.viewer) : [];
  const add = () => {
    const found = asked && reachNow(studio.viewer, asked, joint || limbs[0]);
    if (found) onChange((now) => [...now, found]);
    else studio.say("Put the playhead inside the insertion: the place is for that time.");
  };
  const set = (/** @type {number} */ index, /** @type {Partial<import("./asked.js").Reach>} */ change) =>
    onChange((now) => now.map((one, i) => (i === index ? { ...one, ...change } : one)));
  return html`<div class="reaches stack" role="group" aria-label="Places to reach">
    ${reaches.map((reach, i) => {
      const { place, at } = reach;
      const name = `${limbName(reach.joint)}, place ${i + 1}`;
      return html`<div key=${i} class="reach" role="group" aria-label=${name} data-testid=${`reach-${i + 1}`}>
        <div class="row">
          <span class="grow cut">${limbName(reach.joint)}</span>
          <label class="row">at
            <${NumberField} min="0.01" max=${seconds} step="0.1" value=${at} disabled=${locked} aria-label=${`${name}: seconds from the start`}
              data-testid=${`reach-${i + 1}-at`}
              use=${(/** @type {number} */ given) => {
                const time = within({ seconds }, given) ?? at;
                set(i, { at: time });
                return time;
              }}
            />s</label>
          <button class="button" disabled=${locked} aria-label=${`Remove ${name}`} data-testid=${`reach-${i + 1}-remove`}
            onClick=${() => onChange((now) => now.filter((_, other) => other !== i))}>Remove</button>
        </div>
        <div class="row places">
          ${AXES.map(
            ([axis, words], k) => html`<label title=${words}>${axis}
              <${NumberField} step="1" value=${Math.round(100 * place[k])} disabled=${locked} aria-label=${`${name}: ${words}`}
                data-testid=${`reach-${i + 1}-${axis}`}
                use=${(/** @type {number} */ given) => {
                  const moved = /** @type {[number, number, number]} */ ([...place]);
                  moved[k] = millimetre(Math.min(Math.max(given / 100, -100), 100));
                  set(i, { place: moved });
                  return Math.round(100 * moved[k]);
                }}
              /></label>`,
          )}
          <span class="hint">cm</span>
        </div>
      </div>`;
    })}
    <div class="row">
      <select class="grow" aria-label="Hand or foot that reaches a place" data-testid="reach-joint" value=${joint || (limbs[0] ?? "")} disabled=${locked || !asked}
        onChange=${(/** @type {any} */ event) => setJoint(event.target.value)}>
        ${!asked && html`<option value="">when there is an insertion</option>`}
        ${limbs.map((name) => html`<option key=${name} value=${name}>${limbName(name)}</option>`)}
      </select>
      <button class="button" data-testid="reach-add" disabled=${locked || !asked || reaches.length >= MAX_REACHES} onClick=${add}
        title=${asked ? "A place for it at the playhead's time, to drag in the viewer" : "When an insertion is in the viewer"}>Add a place</button>
    </div>
  </div>`;
}
