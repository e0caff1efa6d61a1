/** Where the corpus shows each joint of an alternative, in words. */

import { html } from "../vendor/htm-preact-standalone.js";

const HOW = /** @type {Record<string, string>} */ ({
  waits: "waits",
  new: "not in any clip",
  between: "blends seen movements",
});

/** A joint's name in words. @param {string} name */
export function jointName(name) {
  return name.replaceAll("_", " ");
}

/**
 * Describe a joint's movement at a time.
 * @param {import("./desk.js").Stretch[] | undefined} stretches
 * @param {number} time seconds
 */
export function seenWords(stretches, time) {
  const stretch = stretches?.findLast(({ begins }) => begins <= time + 1e-6);
  return stretch ? words(stretch) : "";
}

/** @param {import("./desk.js").Stretch} stretch */
function words(stretch) {
  return stretch.how === "seen" ? `seen in ${stretch.where}` : HOW[stretch.how];
}

/** The stretches of each joint. @param {{account: import("./desk.js").Account, point: (joint: string | null) => void}} props */
export function Joints({ account, point }) {
  return html`<details class="joints">
    <summary>Details</summary>
    ${account.details && html`<p class="hint">${account.details}</p>`}
    <dl>
      ${Object.entries(account.joints).map(
        ([joint, stretches]) => html`<div tabindex="0" onMouseEnter=${() => point(joint)} onMouseLeave=${() => point(null)} onFocus=${() => point(joint)} onBlur=${() => point(null)}>
          <dt>${joint}</dt>
          <dd>
            ${stretches.map(
              (stretch) =>
                html`<span class="how-${stretch.how}">${stretch.begins.toFixed(1)}–${stretch.ends.toFixed(1)} s: ${words(stretch)}</span>`,
            )}
          </dd>
        </div>`,
      )}
    </dl>
  </details>`;
}
