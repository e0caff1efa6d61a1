/** Rename and delete the user's own postures. The piece does not change. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { thumbnail } from "../places.js";
import { useChange } from "../shell/hooks.js";

const MAX_NAME_LENGTH = 40; // as in pose/keep.js

/** @typedef {{name: string, key: string}} Saved */

/** The dialog. @param {{studio: any, close: () => void}} props */
export function Own({ studio, close }) {
  const { store, api } = studio;
  const dialog = useRef(/** @type {any} */ (null));
  const restore = useRef(/** @type {any} */ (null));
  const restored = useRef(0); // counts restored postures, which the user may delete again at once
  /** @type {Saved[]} */
  const postures = useChange(store, () => store.state.postures);
  const [wrong, setWrong] = useState("");
  const [gone, setGone] = useState(/** @type {Saved | null} */ (null));
  useLayoutEffect(() => dialog.current.showModal(), []);
  useEffect(() => restore.current?.focus(), [gone]); // the focused row is gone
  const has = (/** @type {string} */ name) => store.state.postures.some((/** @type {Saved} */ one) => one.name === name);
  const rename = (/** @type {Saved} */ one, /** @type {string} */ name) => {
    setGone(null);
    setWrong(has(name) ? `${name} already exists: choose another name.` : "");
    if (has(name)) return;
    const edits = [
      { edit: "posture", name, posture: one.key },
      { edit: "posture", name: one.name, posture: null },
    ];
    studio.once(`rename ${one.name}`, () => api.edit({ edit: "several", words: "rename a posture", edits }));
  };
  const remove = (/** @type {Saved} */ one) =>
    studio.once(`delete ${one.name} ${restored.current}`, async () => {
      await api.edit({ edit: "posture", name: one.name, posture: null });
      setWrong("");
      setGone(one);
    });
  const bringBack = (/** @type {Saved} */ { name, key }) => {
    setGone(null);
    studio.once(`restore ${name} ${restored.current++}`, () => api.edit({ edit: "posture", name, posture: key }));
  };
  return html`<dialog ref=${dialog} class="sheet own-postures" data-testid="own-postures" aria-label="Your own postures" onClose=${close}>
    <form method="dialog" class="row">
      <h2 class="grow">Your own postures</h2>
      <button class="button">Close</button>
    </form>
    <p class="hint">The time line does not change.</p>
    <p role="status" class="row">
      ${wrong && html`<span class="said error">${wrong}</span>`}
      ${gone &&
      !has(gone.name) &&
      html`<span class="grow cut">Deleted ${gone.name}.</span>
        <button ref=${restore} class="button" data-testid="restore" onClick=${() => bringBack(gone)}>Restore</button>`}
    </p>
    <ul class="stack">
      ${postures.map((one) => html`<${Row} key=${one.name} one=${one} rename=${rename} remove=${remove} />`)}
    </ul>
    ${postures.length === 0 && html`<p class="empty">No saved postures. Pose one and save it by name.</p>`}
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
    <input class="field grow" data-testid="name-${one.name}" aria-label="Name of ${one.name}" maxlength=${MAX_NAME_LENGTH} value=${written}
      onInput=${(/** @type {any} */ event) => write(event.target.value)}
      onBlur=${save}
      onKeyDown=${(/** @type {any} */ event) => event.key === "Enter" && save()} />
    <button class="button" data-testid="delete-${one.name}" aria-label="Delete ${one.name}" onClick=${() => remove(one)}>Delete</button>
  </li>`;
}
