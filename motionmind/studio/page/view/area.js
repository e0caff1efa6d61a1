/** The stage of the piece: its width and depth, which the project keeps, and its edge on the viewer's floor. */

import { html, useLayoutEffect } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { useStore } from "../store.js";

const [LEAST_M, MOST_M] = [1, 200];
const DEPTH_RATIO = 0.75; // of the width, until a depth is given

/** The stage as text, which compares; "" without one. @param {any} store */
const written = ({ state }) => state?.stage?.join(" ") ?? "";

/** Draw the edge on the viewer's floor. @param {any} studio */
export function useArea(studio) {
  const text = useStore(studio, written);
  useLayoutEffect(() => {
    studio.viewer.area = text ? text.split(" ").map(Number) : undefined;
  }, [text]);
}

/** Fields for the width and the depth. @param {{studio: any}} props */
export function StageFields({ studio }) {
  const text = useStore(studio, written);
  const size = text ? text.split(" ").map(Number) : null;
  const set = (/** @type {number[] | null} */ now) => {
    const wanted = now && now.map((side) => Math.round(100 * Math.min(Math.max(side, LEAST_M), MOST_M)) / 100);
    if (wanted?.join(" ") !== (text || undefined)) studio.act(() => studio.api.edit({ edit: "stage", size: wanted }));
    return wanted;
  };
  const field = (/** @type {number} */ at, /** @type {string} */ name) => html`<${NumberField} nullable min=${LEAST_M} max=${MOST_M} step="0.5"
    value=${size?.[at] ?? ""} placeholder="none" aria-label=${`Stage: ${name}, metres`} data-testid=${`stage-${name}`}
    use=${(/** @type {number | null} */ given) => {
      const first = given === null ? null : (size ?? [given, DEPTH_RATIO * given]);
      return set(given !== null && first ? first.map((side, i) => (i === at ? given : side)) : null)?.[at] ?? null;
    }}
  />`;
  return html`<div class="row area" role="group" aria-label="Stage" title="The edge of the stage, around the middle of the floor">
    <span class="hint">Stage</span> ${field(0, "width")} <span class="hint">×</span> ${field(1, "depth")} <span class="hint">m</span>
  </div>`;
}
