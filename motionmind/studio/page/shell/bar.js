/** The top bar: the piece's title, undo and redo, theme, keys, and the connection's state. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { filmingOf } from "../export/filming.js";
import { preparing } from "../store.js";
import { useChange, useKeys } from "./hooks.js";
import { icon } from "./icons.js";
import { shownKeys } from "./keys.js";

/** @param {{studio: any}} props */
export function Bar({ studio }) {
  const { store, viewer } = studio;
  const state = useChange(store, () => store.state);
  const refusal = useChange(store, () => store.refusal);
  const connected = useChange(store, () => store.connected !== false);
  const dark = useChange(viewer.theme, () => viewer.theme.dark);
  const [sheet, setSheet] = useState(false);
  // A key may be pressed with nothing to undo, and before the last edit is answered.
  const undo = () => studio.act(() => studio.api.changed.then(() => store.state?.undo && studio.api.undo()));
  const redo = () => studio.act(() => studio.api.changed.then(() => store.state?.redo && studio.api.redo()));
  useKeys(studio, [
    { keys: ["Ctrl+z"], does: "undo", act: undo },
    { keys: ["Ctrl+Shift+z", "Ctrl+y"], shown: ["Ctrl+Shift+Z"], does: "redo", act: redo },
    { keys: ["d"], does: "dark or light", act: () => viewer.theme.toggle() },
    { keys: ["p"], does: "go to the panels", act: () => focus(".rail [aria-selected=true]") },
    { keys: ["t"], does: "go to the time line", act: () => focus(".timeline .stretches [tabindex='0']") },
    { keys: ["?"], does: "show the keys", act: () => setSheet(true) },
  ]);
  return html`<header class="bar">
    <h1 class="brand">${icon("brand")}<span>MotionMind</span></h1>
    <${Title} studio=${studio} title=${state?.title} />
    ${state?.corpus && html`<span class="hint corpus cut">moves like <strong>${state.corpus}</strong></span>`}
    <span class="space"></span>
    <${Readiness} store=${store} />
    <${Film} studio=${studio} />
    ${!connected && html`<span class="offline" role="alert" data-testid="offline">Not connected: edits are not saved${refusal && `; ${refusal}`}</span>`}
    ${button("undo", "Undo", state?.undo, undo)} ${button("redo", "Redo", state?.redo, redo)}
    <button
      class="button quiet icon"
      data-testid="dark"
      aria-label="Dark"
      aria-pressed=${String(dark)}
      title="Dark or light (D)"
      onClick=${() => viewer.theme.toggle()}
    >
      ${icon("dark")}
    </button>
    <button class="button quiet icon" aria-label="Keys" aria-haspopup="dialog" title="Keys (?)" onClick=${() => setSheet(true)}>
      ${icon("keys")}
    </button>
    ${sheet && html`<${Sheet} studio=${studio} close=${() => setSheet(false)} />`}
  </header>`;
}

/** Focus the first match. @param {string} selector */
function focus(selector) {
  /** @type {HTMLElement | null} */ (document.querySelector(selector))?.focus();
}

/** Progress of the preparation for the first search. @param {{store: any}} props */
function Readiness({ store }) {
  const job = useChange(store, () => preparing(store));
  return (
    job &&
    html`<span class="hint readiness" role="status">${job.words}
      <progress value=${job.done} max=${job.of || 1} aria-label="Getting ready"></progress>
    </span>`
  );
}

/** Progress of a film in the making; a click opens the panel that can stop it. @param {{studio: any}} props */
function Film({ studio }) {
  const filming = filmingOf(studio);
  const share = useChange(filming, () => filming.share);
  return (
    share !== null &&
    html`<button class="button quiet numbers" data-testid="filming" title="Making a film: open the panel to stop it"
      onClick=${() => studio.open("take")}>
      Film ${Math.round(100 * share)} %
    </button>`
  );
}

/** @param {string} name @param {string} label @param {string | null | undefined} what @param {() => void} act */
function button(name, label, what, act) {
  const title = what ? `${label}: ${what}` : `Nothing to ${name}`;
  return html`<button
    class="button quiet icon"
    data-testid=${name}
    aria-label=${what ? `${label}: ${what}` : label}
    title=${title}
    disabled=${!what}
    onClick=${act}
  >
    ${icon(name)}
  </button>`;
}

/** @param {{studio: any, title?: string}} props; the title is missing until the piece is there */
function Title({ studio, title: known }) {
  const title = known ?? "";
  const [written, write] = useState(title);
  const field = useRef(/** @type {any} */ (null));
  const before = useRef(""); // the title on focus: another window may rename the piece meanwhile
  useEffect(() => {
    if (document.activeElement !== field.current) write(title); // never overwrite what the user is typing
    document.title = title ? `${title} · MotionMind studio` : "MotionMind studio";
  }, [title]);
  const save = () => {
    const wanted = written.trim();
    if (wanted && ![before.current, title].includes(wanted)) studio.act(() => studio.api.edit({ edit: "title", title: wanted }));
    else write(title);
  };
  return html`<input
    ref=${field}
    class="field title"
    data-testid="title"
    aria-label="Title of the piece"
    title="Title of the piece"
    placeholder="Untitled"
    maxlength="200"
    disabled=${known === undefined}
    value=${written}
    onFocus=${() => (before.current = written)}
    onInput=${(/** @type {any} */ event) => write(event.target.value)}
    onBlur=${save}
    onKeyDown=${(/** @type {any} */ event) => {
      if (event.key === "Escape") write(title);
      if (event.key === "Enter" || event.key === "Escape") setTimeout(() => event.target.blur());
    }}
  />`;
}

/** The sheet of keys. @param {{studio: any, close: () => void}} props */
function Sheet({ studio, close }) {
  const dialog = useRef(/** @type {any} */ (null));
  useLayoutEffect(() => dialog.current.showModal(), []);
  return html`<dialog ref=${dialog} class="sheet" data-testid="keys" aria-label="Keys" onClose=${close}>
    <form method="dialog" class="row">
      <h2 class="grow">Keys</h2>
      <button class="button">Close</button>
    </form>
    ${[...studio.keys.groups].map(
      ([group, rows]) => html`<h3>${group}</h3>
        <dl>
          ${rows.map(
            (/** @type {any} */ row) => html`<dt>${shownKeys(row).map((key, i) => html`${i > 0 && " "}<kbd>${key}</kbd>`)}</dt>
              <dd>${row.does}</dd>`,
          )}
        </dl>`,
    )}
  </dialog>`;
}
