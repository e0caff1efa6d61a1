/** Fields for numbers. */

import { html, useState } from "../vendor/htm-preact-standalone.js";

/**
 * A field for a number. It keeps what the user is typing while its view is rendered again; then `use` returns the number in
 * use, or null for none, and the field shows it.
 * @param {{value: number | string, use: (given: any) => number | string | null, nullable?: boolean, rest?: unknown}} props an empty
 *   field is null if it is `nullable`, otherwise 0
 */
export function NumberField({ value, use, nullable = false, ...rest }) {
  const [written, write] = useState(/** @type {string | null} */ (null));
  return html`<input
    class="field numbers"
    type="number"
    ...${rest}
    value=${written ?? value}
    onInput=${(/** @type {any} */ event) => write(event.target.value)}
    onChange=${(/** @type {any} */ event) => {
      const { value: given } = event.target;
      event.target.value = String(use(nullable && given === "" ? null : Number(given)) ?? "");
      write(null);
    }}
    onBlur=${() => write(null)}
  />`;
}
