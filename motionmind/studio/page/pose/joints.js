/** Sliders for the angles of one joint, within their limits. */

import { html } from "../vendor/htm-preact-standalone.js";

/** @param {{editor: import("./session.js").Editor}} props */
export function Joints({ editor }) {
  const { joints, selected, turns } = editor;
  return html`<section class="stack" aria-label="One joint">
    <label class="stack">
      <h3>One joint</h3>
      <select
        data-testid="pose-joint"
        value=${selected}
        onChange=${(/** @type {any} */ event) => editor.select(event.target.value)}
      >
        ${joints.map(({ joint, words }) => html`<option value=${joint}>${words}</option>`)}
      </select>
    </label>
    ${turns.filter((turn) => turn.joint === selected).map((turn) => html`<${Angle} key=${`${turn.joint} ${turn.angle}`} editor=${editor} turn=${turn} />`)}
  </section>`;
}

/** @param {{editor: import("./session.js").Editor, turn: import("./session.js").Turn}} props */
function Angle({ editor, turn }) {
  const { joint, words, angle, label, least, most, degrees } = turn;
  return html`<label class="turn">
    <span>${label}</span>
    <span class="numbers pale">${Math.round(degrees)}°</span>
    <input
      type="range"
      data-testid=${`turn-${joint}-${angle}`}
      aria-label=${`${words}: ${label}, degrees`}
      min=${Math.ceil(least)}
      max=${Math.floor(most)}
      step="1"
      value=${Math.round(degrees)}
      onInput=${(/** @type {any} */ event) => editor.turn(turn, Number(event.target.value))}
      onChange=${() => editor.end()}
    />
  </label>`;
}
