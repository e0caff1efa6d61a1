/** Postures of one's own: renamed and deleted. What was made of them stays as it is. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { thumbnail } from "../places.js";
import { useChange } from "../shell/hooks.js";

const LONGEST = 40; // characters of a name, as where it is saved

/** @typedef {{name: string, key: string}} Saved */

/** The sheet on which they are. @param {{studio: any, close: () => void}} props */
export function Own({ studio, close }) {
  const { store, api } = studio;
  const dialog = useRef(/** @type {any} */ (null));
  const restore = useRef(/** @type {any} */ (null));
  const brought = useRef(0); // whoever brings a posture back may delete it at once again
  /** @type {Saved[]} */
  const postures = useChange(store, () => store.state.postures);
  const [wrong, setWrong] = useState("");
  const [gone, setGone] = useState(/** @type {Saved | null} */ (null));
  useLayoutEffect(() => dialog.current.showModal(), []);
  useEffect(() => restore.current?.focus(), [gone]); // what had the focus is gone
  const has = (/** @type {string} */ name) => store.state.postures.some((/** @type {Saved} */ one) => one.name === name);
  const rename = (/** @type {Saved} */ one, /** @type {string} */ name) => {
    setGone(null);
    setWrong(has(name) ? `${name} is there already: choose another name.` : "");
    if (has(name)) return;
    const edits = [
      { edit: "posture", name, posture: one.key },
      { edit: "posture", name: one.name, posture: null },
    ];
    studio.once(`rename ${one.name}`, () => api.edit({ edit: "several", words: "rename a posture", edits }));
  };
  const remove = (/** @type {Saved} */ one) =>
    studio.once(`delete ${one.name} ${brought.current}`, async () => {
      await api.edit({ edit: "posture", name: one.name, posture: null });
      setWrong("");
      setGone(one);
    });
  const bring = (/** @type {Saved} */ { name, key }) => {
    setGone(null);
    studio.once(`restore ${name} ${brought.current++}`, () => api.edit({ edit: "posture", name, posture: key }));
  };
  return html`<dialog ref=${dialog} class="sheet own-postures" data-testid="own-postures" aria-label="Your own postures" onClose=${close}>
    <form method="dialog" class="row">
      <h2 class="grow">Your own postures</h2>
      <button class="button">Close</button>
    </form>
    <p class="hint">What is on the time line stays there, whatever becomes of the posture.</p>
    <p role="status" class="row">
      ${wrong && html`<span class="said error">${wrong}</span>`}
      ${gone &&
      !has(gone.name) &&
      html`<span class="grow cut">${gone.name} is deleted.</span>
        <button ref=${restore} class="button" data-testid="restore" onClick=${() => bring(gone)}>Bring it back</button>`}
    </p>
    <ul class="stack">
      ${postures.map((one) => html`<${Row} key=${one.name} one=${one} rename=${rename} remove=${remove} />`)}
    </ul>
    ${postures.length === 0 && html`<p class="empty">No posture is saved. Pose one, and save it by name.</p>`}
  </dialog>`;
}

/** @param {{one: Saved, rename: (one: Saved, name: string) => void, remove: (one: Saved) => void}} props */
function Row({ one, rename, remove }) {
  const [written, write] = useState(one.name);
  const save = () => {
    const name = written.trim();
    write(one.name);
    if (name && name !== one.name) rename(one, name);
  };
  return html`<li class="row">
    <img src=${thumbnail(one.key, 0, 64)} alt="" width="48" height="64" />
    <input class="field grow" data-testid="name-${one.name}" aria-label="Name of ${one.name}" maxlength=${LONGEST} value=${written}
      onInput=${(/** @type {any} */ event) => write(event.target.value)}
      onBlur=${save}
      onKeyDown=${(/** @type {any} */ event) => event.key === "Enter" && save()} />
    <button class="button" data-testid="delete-${one.name}" aria-label="Delete ${one.name}" onClick=${() => remove(one)}>Delete</button>
  </li>`;
}
