/** The pose panel: where to start, how well the corpus knows the posture, its joints, and how to use it. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";
import { dropped } from "../between/desk.js";
import { stable } from "../places.js";
import { useChange, useKeys } from "../shell/hooks.js";
import { balanceWords } from "./balance.js";
import { Handles } from "./handles.js";
import { Joints } from "./joints.js";
import { Keep } from "./keep.js";
import { editorOf } from "./session.js";

const GROUP = "Pose";
const KNOWN = /** @type {[import("./session.js").Known, string][]} */ ([
  ["seen", "seen"],
  ["near", "nearly"],
  ["unseen", "never"],
]);

/** @param {{studio: any}} props */
export function Panel({ studio }) {
  const editor = editorOf(studio);
  useChange(editor, () => editor.version);
  useChange(studio.viewer, () => studio.viewer.motion, "show"); // whether it shows the posture
  useEffect(() => {
    if (editor.motion) editor.show();
    else studio.act(() => start(studio));
    const handles = new Handles(editor);
    return () => {
      handles.remove();
      editor.leave();
    };
  }, []);
  useKeys(studio, [
    { keys: ["Ctrl+z"], does: "undo the last change of the posture", group: GROUP, act: (event) => isOfPosture(event, editor, editor.began ?? editor.past[0]) && editor.undo() },
    { keys: ["Ctrl+Shift+z", "Ctrl+y"], shown: ["Ctrl+Shift+Z"], does: "redo it", group: GROUP, act: (event) => isOfPosture(event, editor, editor.future[0]) && editor.redo() },
    { keys: ["k"], does: "match the corpus", group: GROUP, act: () => toKnown(editor) },
    { keys: ["f"], does: "put the feet on the floor", group: GROUP, act: () => toFloor(editor) },
    { shown: ["Tab"], does: "go from handle to handle", group: GROUP },
    { shown: ["arrows", "Page up", "Page down"], does: "move a handle across the view, away, towards (with Shift farther)", group: GROUP },
  ]);
  return html`<div class="pose stack" data-testid="editor">
    <h2 class="aside">Pose a body by hand</h2>
    <${Start} studio=${studio} />
    ${
      editor.motion
        ? html`<${Known} editor=${editor} />
            <p class="hint" data-testid="balance">${balanceWords(editor.balance)}</p>
            <${Whole} editor=${editor} />
            <${Keep} studio=${studio} editor=${editor} />
            <${Joints} editor=${editor} />`
        : html`<p class="empty">Show a movement in the viewer, then pose a frame of it.</p>`
    }
  </div>`;
}

/**
 * Whether a key undoes or redoes a change of the posture: only if the viewer shows it, and not on the time line.
 * @param {Event} event @param {import("./session.js").Editor} editor @param {unknown} change
 */
function isOfPosture({ target }, editor, change) {
  return Boolean(change) && editor.shown && !(target instanceof Element && target.closest(".timeline"));
}

/** The choice of a posture to start from. @param {{studio: any}} props */
function Start({ studio }) {
  const editor = editorOf(studio);
  const postures = useGallery(studio);
  const open = (/** @type {string} */ key, frame = 0, title = "") => studio.act(() => editor.open(key, frame, title));
  const drop = (/** @type {DragEvent} */ event) => {
    event.preventDefault();
    const place = dropped(event);
    if (place) open(place.key, place.frame, place.title);
  };
  const moment = editor.shown ? null : studio.viewer.moment;
  return html`<div onDragOver=${(/** @type {Event} */ event) => event.preventDefault()} onDrop=${drop}>
    <label class="stack">
      <h3>Start from</h3>
      <select
        data-testid="pose-from"
        value=${postures.some(({ of }) => of.some(({ key }) => key === editor.key)) ? editor.key : ""}
        onChange=${(/** @type {any} */ event) => event.target.value && open(event.target.value, 0, event.target.selectedOptions[0].text)}
      >
        <option value="">${editor.title || "a posture"}</option>
        ${postures.map(
          (one) =>
            html`<optgroup label=${one.group}>${one.of.map((posture) => html`<option value=${posture.key}>${posture.title}</option>`)}</optgroup>`,
        )}
      </select>
    </label>
    ${
      moment &&
      html`<button class="button" data-testid="pose-moment" onClick=${() => open(moment.key, moment.frame, momentName(studio))}>
        Pose this moment
      </button>`
    }
    ${editor.motion && !editor.shown && html`<button class="button" onClick=${() => editor.show()}>Back to the posture</button>`}
  </div>`;
}

/** How well the corpus knows the posture. @param {{editor: import("./session.js").Editor}} props */
function Known({ editor }) {
  const { known, corpus, joints, words } = editor;
  if (!known.length) return html`<p class="hint">${corpus} has a different body: it does not know these joints.</p>`;
  const strangers = joints.filter((_, i) => known[i] === "unseen").map((joint) => joint.words);
  return html`<section aria-label="Joints in the corpus">
    <h3>Joints seen in ${corpus}</h3>
    <div class="known" data-testid="known">
      ${KNOWN.map(
        ([how, label]) =>
          html`<span><span class="known-mark ${how}" aria-hidden="true"></span>${known.filter((one) => one === how).length} ${label}</span>`,
      )}
    </div>
    <p class="hint strangers" aria-live="polite" data-testid="strangers">
      ${words || (strangers.length ? `Never seen: ${strangers.slice(0, 4).join(", ")}${strangers.length > 4 ? " …" : ""}` : "")}
    </p>
  </section>`;
}

/** Buttons that change the whole posture. @param {{editor: import("./session.js").Editor}} props */
function Whole({ editor }) {
  const { past, future, known, standing, released, joints, mirrors } = editor;
  const strange = known.includes("unseen");
  const wordsOf = (/** @type {string} */ joint) => joints.find((one) => one.joint === joint)?.words.replace(/ toes$/, " foot") ?? joint;
  return html`<section class="stack" aria-label="The whole posture">
    <div class="row wide">
      <button class="button ${strange ? "primary" : ""}" data-testid="to-known" disabled=${known.every((one) => one === "seen")} onClick=${() => toKnown(editor)}>
        Match the corpus
      </button>
      <button class="button" data-testid="to-whole" disabled=${!known.length} onClick=${() => editor.change("whole", "take the nearest posture")}>
        Nearest posture
      </button>
      <button class="button" data-testid="to-floor" onClick=${() => toFloor(editor)}>Feet on the floor</button>
      <button class="button" data-testid="mirror-posture" disabled=${!mirrors} onClick=${() => editor.change("mirror", "mirror the posture")}>
        Mirror
      </button>
      <button class="button" data-testid="pose-undo" disabled=${!past.length} title=${past.at(-1)?.words ?? ""} onClick=${() => editor.undo()}>
        Undo
      </button>
      <button class="button" data-testid="pose-redo" disabled=${!future.length} title=${future.at(-1)?.words ?? ""} onClick=${() => editor.redo()}>
        Redo
      </button>
    </div>
    ${standing.map(
      (foot) =>
        html`<label class="check">
          <input
            type="checkbox"
            checked=${!released.has(foot)}
            onChange=${(/** @type {any} */ event) => editor.hold(foot, event.target.checked)}
          />
          Keep the ${wordsOf(foot)} in place
        </label>`,
    )}
  </section>`;
}

/** @param {import("./session.js").Editor} editor */
function toKnown(editor) {
  return editor.change("known", "match the corpus");
}

/** @param {import("./session.js").Editor} editor */
function toFloor(editor) {
  return editor.change("floor", "put the feet on the floor");
}

/** Start from the moment in view, or else from the first posture of the gallery. @param {any} studio */
async function start(studio) {
  const { moment } = studio.viewer;
  const from = moment ?? listed(await studio.api.get("/api/gallery"))[0]?.of[0];
  if (from) await editorOf(studio).open(from.key, from.frame ?? 0, moment ? momentName(studio) : "");
}

/** The name of the moment in view if it is the piece's; "" for its movement's title. @param {any} studio */
function momentName({ viewer, store }) {
  return viewer.isHome ? `${store.state.title || "the piece"} at ${viewer.player.time.toFixed(1)} s` : "";
}

/** The gallery's postures, in groups. @param {any} studio */
function useGallery(studio) {
  const [found, setFound] = useState(/** @type {ReturnType<typeof listed>} */ ([]));
  const saved = useChange(studio.store, () => JSON.stringify(studio.store.state?.postures ?? null));
  useEffect(() => {
    studio.act(async () => setFound(listed(await studio.api.get("/api/gallery"))));
  }, [saved]);
  return found;
}

/**
 * @param {{corpora: {name: string, postures: {key: string, title: string}[]}[], own: {key: string, title: string}[]}} gallery
 * @returns {{group: string, of: {key: string, title: string, frame?: number}[]}[]}
 */
function listed({ corpora, own }) {
  const fixed = own.map(({ key, title }) => ({ key: stable(key), title })); // unchanged when the posture is renamed
  const groups = [{ group: "Your own", of: fixed }, ...corpora.map(({ name, postures }) => ({ group: name, of: postures }))];
  return groups.filter(({ of }) => of.length > 0);
}
