/** The user's own movement: upload files, watch them, put them on the time line, learn from them; browse corpora. */

import { html, useEffect, useMemo, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { playable } from "../movements.js";
import { AsScore } from "../scores/panel.js";
import { perStudio, useChange } from "../shell/hooks.js";
import { insert, newId } from "../timeline/items.js";
import { Corpora } from "./corpora.js";
import { FileCard } from "./file.js";
import { ACCEPT, Imports } from "./imports.js";
import { Learn } from "./learn.js";

export { Centre } from "../scores/editor.js";

const importsOf = perStudio((studio) => new Imports(studio.api));

/** @param {{studio: any}} props */
export function Panel({ studio }) {
  const imports = useMemo(() => importsOf(studio), [studio]);
  useChange(imports, () => imports.version);
  const chooser = useRef(/** @type {HTMLInputElement | null} */ (null));
  const [over, setOver] = useState(false);
  const failed = (/** @type {Error} */ error) => studio.say(error.message, { kind: "error" });
  const learning = useChange(studio.store, () => [...studio.store.jobs.values()].filter((job) => job.kind === "learn" && job.state === "done").length);
  useEffect(() => {
    imports.refresh().catch(failed);
    if (learning) studio.store.load().catch(failed); // the piece may have needed this corpus
  }, [learning]);
  useEffect(() => () => studio.viewer.back(), []);
  const look = async (/** @type {any} */ file, /** @type {number} */ clip) => {
    const data = await imports.movement(file, clip);
    studio.viewer.show(playable(data), { time: 0, title: `${file.name}${file.facts.clips.length > 1 ? `: ${data.name}` : ""}`, play: true });
  };
  const put = async (/** @type {any} */ file, /** @type {number} */ clip) => {
    const { key, frames } = await imports.keep(file, clip);
    await studio.api.edit(insert(newId(studio.window), { key, frame: 0, last: frames - 1 }));
    studio.viewer.back();
    studio.say(`${file.facts.clips[clip].name} is on the time line.`);
  };
  const drop = (/** @type {DragEvent} */ event) => {
    event.preventDefault();
    setOver(false);
    if (event.dataTransfer?.files.length) imports.add(event.dataTransfer.files);
  };
  return html`<section
    class="stack imports ${over ? "over" : ""}"
    onDragOver=${(/** @type {DragEvent} */ event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      setOver(true);
    }}
    onDragLeave=${() => setOver(false)}
    onDrop=${drop}
  >
    <h2>Movement</h2>
    <div class="empty drop">
      <input ref=${chooser} type="file" hidden data-testid="choose-files" aria-label="Files" multiple accept=${ACCEPT}
        onChange=${(/** @type {any} */ event) => {
          imports.add(event.target.files);
          event.target.value = "";
        }} />
      <button class="button" data-testid="choose" onClick=${() => chooser.current?.click()}>Choose files</button>
      <span>or drop them here: BVH, GLB, AMC with ASF, npz, or scores</span>
    </div>
    <ul class="stack files" aria-label="Files">
      ${imports.coming.map(
        (coming) => html`<li class="card file" key=${coming.number} data-testid="coming">
          <div class="row"><strong class="grow cut">${coming.name}</strong>
            ${coming.error && html`<button class="button quiet" aria-label="Close" onClick=${() => imports.dismiss(coming)}>Close</button>`}</div>
          ${coming.error ? html`<p class="said error" role="alert" data-testid="file-error">${coming.error}</p>` : html`<p class="hint" aria-live="polite">Reading…</p>`}
        </li>`,
      )}
      ${imports.files.map(
        (file) => html`<${FileCard} key=${file.id} imports=${imports} file=${file} onFail=${failed}
          onLook=${(/** @type {number} */ clip) => look(file, clip).catch(failed)} onPut=${(/** @type {number} */ clip) => studio.once(`put ${file.id} ${clip}`, () => put(file, clip))} />`,
      )}
    </ul>
    <${AsScore} studio=${studio} />
    <${Learn} studio=${studio} imports=${imports} />
    <${Corpora} studio=${studio} imports=${imports} />
  </section>`;
}
