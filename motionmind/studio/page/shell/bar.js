/** The top bar: the piece's title, undo and redo, theme, keys, and the connection's state. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { STEPS } from "../between/steps.js";
import { filmingOf } from "../export/filming.js";
import { preparing } from "../store.js";
import { useChange, useKeys } from "./hooks.js";
import { icon } from "./icons.js";
import { shownKeys } from "./keys.js";
import { Saved } from "./saved.js";
import { Share } from "./share.js";

/** @param {{studio: any}} props */
export function Bar({ studio }) {
  const { store } = studio;
  const state = useChange(store, () => store.state);
  const connected = useChange(store, () => store.connected !== false);
  // A key may be pressed with nothing to undo, and before the last edit is answered.
  const undo = () => studio.act(() => studio.api.changed.then(() => store.state?.undo && studio.api.undo()));
  const redo = () => studio.act(() => studio.api.changed.then(() => store.state?.redo && studio.api.redo()));
  useKeys(studio, [
    { keys: ["Ctrl+z"], does: "undo", act: undo },
    { keys: ["Ctrl+Shift+z", "Ctrl+y"], shown: ["Ctrl+Shift+Z"], does: "redo", act: redo },
    { keys: ["p"], does: "go to the panels", act: () => focus(".rail [aria-selected=true]") },
    { keys: ["t"], does: "go to the time line", act: () => focus(".timeline .stretches [tabindex='0']") },
  ]);
  return html`<header class="bar">
    <h1 class="brand">${icon("brand")}<span>MotionMind</span></h1>
    <${Title} studio=${studio} title=${state?.title} />
    ${state && connected && html`<${Saved} state=${state} />`}
    ${state?.corpus && html`<span class="hint corpus cut">moves like <strong>${state.corpus}</strong></span>`}
    <span class="space"></span>
    <${Readiness} store=${store} />
    <${Film} studio=${studio} />
    <${Offline} store=${store} words="Not connected: edits are not saved" />
    ${state?.access === "shared" && html`<${Share} studio=${studio} />`}
    ${button("undo", "Undo", state?.undo, undo)} ${button("redo", "Redo", state?.redo, redo)}
    <${Everywhere} studio=${studio} steps=${STEPS} />
  </header>`;
}

/** Says that there is no connection, and why the studio refuses the page, if it does. @param {{store: any, words: string}} props */
export function Offline({ store, words }) {
  const refusal = useChange(store, () => store.refusal);
  const connected = useChange(store, () => store.connected !== false);
  return !connected && html`<span class="offline" role="alert" data-testid="offline">${words}${refusal && `; ${refusal}`}</span>`;
}

/** Buttons of every page: dark or light, and the sheet of keys. @param {{studio: any, steps?: string[]}} props */
export function Everywhere({ studio, steps = [] }) {
  const { viewer } = studio;
  const dark = useChange(viewer.theme, () => viewer.theme.dark);
  const [sheet, setSheet] = useState(false);
  useKeys(studio, [
    { keys: ["i"], does: "dark or light (invert)", act: () => viewer.theme.toggle() },
    { keys: ["?"], does: steps.length ? "show the first steps and the keys" : "show the keys", act: () => setSheet(true) },
  ]);
  return html`<button
      class="button quiet icon"
      data-testid="dark"
      aria-label="Dark"
      aria-pressed=${String(dark)}
      title="Dark or light (I)"
      onClick=${() => viewer.theme.toggle()}
    >
      ${icon("dark")}
    </button>
    <button class="button quiet icon" aria-label="Keys" aria-haspopup="dialog" title="Keys (?)" onClick=${() => setSheet(true)}>
      ${icon("keys")}
    </button>
    ${sheet && html`<${Sheet} studio=${studio} steps=${steps} close=${() => setSheet(false)} />`}`;
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

/** The sheet of keys. @param {{studio: any, steps: string[], close: () => void}} props */
function Sheet({ studio, steps, close }) {
  const dialog = useRef(/** @type {any} */ (null));
  useLayoutEffect(() => dialog.current.showModal(), []);
  return html`<dialog ref=${dialog} class="sheet" data-testid="keys" aria-label="Keys" onClose=${close}>
    <form method="dialog" class="row">
      <h2 class="grow">Keys</h2>
      <button class="button">Close</button>
    </form>
    ${
      steps.length > 0 &&
      html`<h3>First steps</h3>
        <ol>${steps.map((step, i) => html`<li><span class="number" aria-hidden="true">${i + 1}</span><span>${step}</span></li>`)}</ol>`
    }
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
