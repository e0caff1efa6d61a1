/** The reference video beside the viewer: chosen by path or as a file, and shifted against the piece. */

import { html, useEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { icon } from "../shell/icons.js";
import { useStore } from "../store.js";
import { Follow } from "./follow.js";
import { MOST_S, useShift } from "./shift.js";

const S_PER_PX = 0.01; // of a drag
const KEY_STEP_S = 0.04; // a frame at 25 frames a second

/** @param {{studio: any, hidden: boolean}} props; hidden, it keeps its file */
export function Pane({ studio, hidden }) {
  const kept = useStore(studio, ({ state }) => state?.reference);
  const [file, setFile] = useState(/** @type {{name: string, path: string, src: string, begins: number} | null} */ (null));
  const [fault, setFault] = useState("");
  useEffect(() => setFault(""), [kept?.path, file?.src]);
  useEffect(() => () => (file ? URL.revokeObjectURL(file.src) : undefined), [file?.src]);
  const byPath = kept?.path
    ? { ...kept, name: kept.path.split(/[\\/]/).at(-1), src: `/api/reference?of=${encodeURIComponent(kept.path)}` }
    : null;
  const shown = file ?? byPath;
  const set = (/** @type {number} */ begins) => {
    if (!file) return studio.act(() => studio.api.edit({ edit: "reference", path: kept.path, begins }));
    setFile({ ...file, begins });
    return undefined;
  };
  const remove = () => (file ? setFile(null) : studio.act(() => studio.api.edit({ edit: "reference" })));
  const take = (/** @type {File} */ chosen) => setFile({ name: chosen.name, path: "", src: URL.createObjectURL(chosen), begins: 0 });
  return html`<section class="reference" aria-label="Reference video" data-testid="reference" hidden=${hidden}>
    ${
      shown &&
      html`<${Film} key=${shown.src} studio=${studio} shown=${shown} set=${set} fail=${(/** @type {string} */ words) => setFault(words)} hidden=${fault !== ""} />
        <div class="row">
          <span class="hint cut grow" title=${shown.path || shown.name}>${shown.name}</span>
          <button class="button quiet icon" aria-label="Remove the video" title="Remove the video" data-testid="reference-remove" onClick=${remove}>${icon("close")}</button>
        </div>`
    }
    ${fault && html`<p class="said error" role="alert" data-testid="reference-fault">${icon("warning")}<span>${fault}</span></p>`}
    ${(!shown || fault) && html`<${Choose} studio=${studio} take=${take} />`}
  </section>`;
}

/** Choose a video. @param {{studio: any, take: (file: File) => void}} props */
function Choose({ studio, take }) {
  const [path, setPath] = useState("");
  const open = (/** @type {Event} */ event) => {
    event.preventDefault();
    studio.once("open a video", async () => studio.store.take(await studio.api.post("/api/reference", { window: studio.window, path: path.trim() })));
  };
  return html`<form class="stack choose" onSubmit=${open}>
    <h3>Reference video</h3>
    <div class="row">
      <input class="field grow" aria-label="Path of the video" placeholder="Path, such as ~/dance.mp4" data-testid="reference-path" value=${path}
        autocomplete="off" spellcheck="false" onInput=${(/** @type {any} */ event) => setPath(event.target.value)} />
      <button class="button" data-testid="reference-open" disabled=${!path.trim()}>Open</button>
    </div>
    <label>Or a file, until the page reloads
      <input type="file" accept="video/*" data-testid="reference-file" onChange=${(/** @type {any} */ event) => event.target.files[0] && take(event.target.files[0])} />
    </label>
    <p class="hint">The video stays on this computer.</p>
  </form>`;
}

/** The video, which a drag shifts against the piece. @param {any} props */
function Film({ studio, shown, set, fail, hidden }) {
  const video = useRef(/** @type {any} */ (null));
  const follow = useRef(/** @type {any} */ (null));
  const [muted, setMuted] = useState(true);
  const { now: begins, shift, keep, handlers } = useShift({ value: shown.begins, digits: 2, step: KEY_STEP_S, perPixel: () => S_PER_PX, set });
  useEffect(() => {
    follow.current = new Follow(video.current, studio.viewer);
    return () => follow.current.end();
  }, []);
  useEffect(() => {
    follow.current.begins = begins;
    follow.current.step();
  }, [begins]);
  const failed = async () => {
    const answer = shown.path && (await fetch(shown.src, { headers: { Range: "bytes=0-0" } }).catch(() => null));
    const told = answer && !answer.ok ? await answer.json().catch(() => ({})) : {};
    fail(told.error ?? `This browser cannot play ${shown.name}. WebM and H.264 (MP4) work almost everywhere.`);
  };
  return html`<div class="film" hidden=${hidden}>
      <video ref=${video} src=${shown.src} muted=${muted} playsinline preload="auto" disablepictureinpicture tabindex="-1" onError=${failed}></video>
      <div
        class="shift"
        role="slider"
        tabindex="0"
        data-testid="reference-shift"
        aria-label="Shift the video"
        aria-valuemin=${-MOST_S}
        aria-valuemax=${MOST_S}
        aria-valuenow=${begins}
        aria-valuetext=${`the piece starts at ${begins.toFixed(2)} s of the video`}
        title="Drag sideways to shift the video against the piece (arrow keys)"
        ...${handlers}
      ></div>
    </div>
    <div class="row" hidden=${hidden}>
      <label class="row grow">Starts at
        <${NumberField} min=${-MOST_S} max=${MOST_S} step="0.01" value=${begins} data-testid="reference-begins" aria-label="Time of the video at the piece's start, seconds"
          use=${(/** @type {number} */ given) => {
            const now = shift(given);
            keep();
            return now;
          }} /> s
      </label>
      <button class="button quiet" aria-pressed=${String(!muted)} data-testid="reference-sound" onClick=${() => setMuted(!muted)}>Sound</button>
    </div>`;
}
