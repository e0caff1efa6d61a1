/** Use a posture: save it by name, use it as A or B, add it to the time line, or copy it for a score. */

import { html, useState } from "../vendor/htm-preact-standalone.js";
import { deskOf } from "../between/desk.js";
import { insert, newId } from "../timeline/items.js";

/** @param {{studio: any, editor: import("./session.js").Editor}} props */
export function Keep({ studio, editor }) {
  const [name, setName] = useState("");
  const [lines, setLines] = useState("");
  const called = name.trim() || fresh(studio);
  const save = async () => {
    const key = await editor.keep(called);
    const replaced = studio.store.state?.postures?.some((/** @type {{name: string}} */ one) => one.name === called);
    await studio.api.edit({ edit: "posture", name: called, posture: key });
    studio.say(replaced ? `Replaced ${called}. Undo restores the old one.` : `Saved as ${called}.`);
    return `own/${called}`;
  };
  const end = (/** @type {"a" | "b"} */ which) => async () => {
    const key = await editor.keep(called);
    deskOf(studio).set(which, { key, frame: 0, title: called });
    studio.open("between");
  };
  const place = async () => {
    const key = await editor.keep(called);
    await studio.api.edit(insert(newId(studio.window), { key, frame: 0 }));
    studio.say("Added to the time line.");
  };
  const copy = async () => {
    const text = await editor.lines(called);
    setLines(text);
    await navigator.clipboard?.writeText(text).then(
      () => studio.say("Copied for a score."),
      () => {},
    );
  };
  const doing = (/** @type {string} */ what, /** @type {() => Promise<any>} */ act) => () => studio.once(`${what} a posture`, act);
  return html`<section class="stack" aria-label="Use the posture">
    <h3>Use it</h3>
    <form
      class="row"
      onSubmit=${(/** @type {Event} */ event) => {
        event.preventDefault();
        doing("save", save)();
      }}
    >
      <input
        class="field grow"
        data-testid="posture-name"
        aria-label="Name of the posture"
        placeholder=${called}
        maxlength="40"
        value=${name}
        onInput=${(/** @type {any} */ event) => setName(event.target.value)}
      />
      <button class="button" type="submit" data-testid="save-posture">Save</button>
    </form>
    <div class="row wide">
      <button class="button" data-testid="use-a" onClick=${doing("begin with", end("a"))}>Use as A</button>
      <button class="button" data-testid="use-b" onClick=${doing("end with", end("b"))}>Use as B</button>
      <button class="button" data-testid="posture-to-timeline" onClick=${doing("insert", place)}>Add to the time line</button>
      <button class="button" data-testid="copy-score" onClick=${doing("copy", copy)}>Copy for a score</button>
    </div>
    ${lines && html`<textarea readonly aria-label="Lines of a score" data-testid="score-lines" value=${lines}></textarea>`}
  </section>`;
}

/** A name that no saved posture has. @param {any} studio */
function fresh(studio) {
  const taken = new Set((studio.store.state?.postures ?? []).map((/** @type {any} */ posture) => posture.name));
  let number = 1;
  while (taken.has(`posture-${number}`)) number++;
  return `posture-${number}`;
}
