/** The first steps, on the stage of an empty piece until something is accepted. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";
import { icon } from "../shell/icons.js";
import { useStore } from "../store.js";
import { deskOf } from "./desk.js";
import { Recent } from "./recent.js";

const BEGUN = "motionmind-begun"; // key in the browser's storage
export const STEPS = [
  "Click two postures of the gallery: the first is A, the second B.",
  "Watch the movements from A to B side by side, and accept one.",
  "Click the next posture: your piece grows on the time line. Every click is saved.",
];

/** @param {{studio: any}} props */
export function Steps({ studio }) {
  const desk = deskOf(studio);
  const count = useStore(studio, ({ state }) => state?.piece.blocks.length);
  const both = useChange(desk, () => Boolean(desk.ends.a && desk.ends.b));
  const [begun, begin] = useState(localStorage.getItem(BEGUN) !== null);
  useEffect(() => {
    if (!count) return;
    localStorage.setItem(BEGUN, "yes");
    begin(true);
  }, [count]);
  if (count !== 0) return null;
  return html`<section class="steps card" aria-label="First steps" data-testid="first-sight">
    ${!begun &&
    html`<ol data-testid="steps">
      ${STEPS.map(
        (step, i) =>
          html`<li class=${i === 0 && both ? "done" : ""} aria-current=${(both ? 1 : 0) === i ? "step" : undefined}>
            <span class="number" aria-hidden="true">${i === 0 && both ? icon("check") : i + 1}</span><span>${step}</span>
          </li>`,
      )}
    </ol>`}
    <${Recent} studio=${studio} />
  </section>`;
}
