/** From A to B: both postures, and the gallery to pick them from. */

import { html } from "../vendor/htm-preact-standalone.js";
import { useChange, useKeys } from "../shell/hooks.js";
import { icon } from "../shell/icons.js";
import { thumbnail } from "../places.js";
import { deskOf, dropped } from "./desk.js";
import { append, Gallery } from "./gallery.js";
import { Places } from "./places.js";

export { Centre } from "./alternatives.js";

const LENGTHS = [0.5, 1, 1.5, 2, 3, 4, 6, 8];
const GROUP = "A to B";

/** @param {{studio: any}} props */
export function Panel({ studio }) {
  const desk = deskOf(studio);
  const ends = useChange(desk, () => desk.ends);
  const choice = useChange(desk, () => desk.choice);
  const seconds = useChange(desk, () => desk.seconds);
  const state = useChange(desk, () => desk.state);
  const shown = useChange(desk, () => desk.shown);
  useKeys(studio, [
    { keys: ["a"], does: "set A to the picked posture, or the viewer's", group: GROUP, act: () => take(studio, "a") },
    { keys: ["b"], does: "set B likewise", group: GROUP, act: () => take(studio, "b") },
    { shown: ["arrows"], does: "go through the gallery", group: GROUP },
  ]);
  return html`<div class="between">
    <h2 class="aside">From one posture to another</h2>
    <div class="ends">
      <${End} studio=${studio} name="a" place=${ends.a} />
      <button
        class="button quiet icon"
        aria-label="Exchange A and B"
        title="Exchange A and B"
        disabled=${!ends.a && !ends.b}
        onClick=${() => desk.swap()}
      >
        ${icon("swap")}
      </button>
      <${End} studio=${studio} name="b" place=${ends.b} />
    </div>
    <label class="row hint">
      Duration
      <select
        data-testid="how-long"
        value=${seconds}
        onChange=${(/** @type {any} */ event) => desk.take(Number(event.target.value))}
      >
        <option value="0">automatic</option>
        ${LENGTHS.map((length) => html`<option value=${length}>${length} s</option>`)}
      </select>
      ${
        !shown &&
        state === "found" &&
        html`<button class="button" onClick=${() => desk.show(true)}>Show the alternatives</button>`
      }
    </label>
    <${Places} studio=${studio} />
    <${Gallery} studio=${studio} />
    <div class="onto">
      <button class="button cut" data-testid="insert-posture" disabled=${!choice} onClick=${() => choice && append(studio, choice)}>
        Add ${choice?.title ?? "it"} to the time line
      </button>
    </div>
  </div>`;
}

/** A or B: its picture, and the button that sets it. @param {{studio: any, name: "a" | "b", place: any}} props */
function End({ studio, name, place }) {
  const desk = deskOf(studio);
  const letter = name.toUpperCase();
  const drop = (/** @type {DragEvent} */ event) => {
    event.preventDefault();
    const found = dropped(event);
    if (found) desk.set(name, { ...found, title: found.title ?? found.key });
  };
  return html`<div class="end ${place ? "card" : "empty"}" onDragOver=${(/** @type {Event} */ event) => event.preventDefault()} onDrop=${drop}>
    ${
      place
        ? html`<img src=${thumbnail(place.key, place.frame, 128)} alt="" />
            <button class="button quiet icon clear" aria-label="Clear ${letter}" onClick=${() => desk.set(name, null)}>
              ${icon("close")}
            </button>
            <span class="letter" aria-hidden="true">${letter}</span>
            <span class="cut name">${place.title}</span>`
        : html`<span class="letter" aria-hidden="true">${letter}</span>
            <p>${name === "a" ? "Start: pick a posture below" : "End"}</p>`
    }
    <button
      class="button"
      data-testid="set-${name}"
      title="Set ${letter} to the picked posture, or the viewer's (${letter})"
      onClick=${() => take(studio, name)}
    >
      Set ${letter}
    </button>
  </div>`;
}

/** Set an end to the picked posture, or to the one in the viewer. @param {any} studio @param {"a" | "b"} name */
function take(studio, name) {
  const desk = deskOf(studio);
  const { viewer } = studio;
  const moment = viewer.moment;
  const picked = desk.choice && (!moment || moment.key === desk.choice.key) ? { ...desk.choice, frame: moment?.frame ?? desk.choice.frame } : desk.choice;
  const place = picked ?? (moment && { ...moment, title: viewer.title || "this posture" });
  if (place) desk.set(name, place);
  else studio.say("Pick a posture in the gallery first, or show one in the viewer.");
}
