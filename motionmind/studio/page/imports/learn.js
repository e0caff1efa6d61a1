/** Learn a corpus from uploaded files and other corpora, with progress. */

import { html, useState } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";

const WEIGHTS = [
  [0.1, "a little"],
  [0.3, "less"],
  [1, "as much"],
  [3, "more"],
];

/** @param {{studio: any, imports: import("./imports.js").Imports}} props */
export function Learn({ studio, imports }) {
  const [name, setName] = useState("");
  const [title, setTitle] = useState("");
  const [mirror, setMirror] = useState(false);
  const [mix, setMix] = useState(/** @type {Record<string, number>} */ ({}));
  const [error, setError] = useState("");
  const [id, setId] = useState("");
  const job = useChange(studio.store, () => studio.store.jobs.get(id));
  const busy = job && (job.state === "waiting" || job.state === "running");
  const count = imports.parts.length;
  const mixed = Object.entries(mix).map(([corpus, weight]) => ({ name: corpus, weight }));
  const ready = name.trim() && (count > 0 || mixed.length > 0) && !busy;
  const learn = async () => {
    try {
      setId(await imports.learn({ name: name.trim(), title, mix: mixed, mirror }));
    } catch (failed) {
      setError(/** @type {Error} */ (failed).message);
    }
  };
  const weigh = (/** @type {string} */ corpus, /** @type {string} */ weight) => {
    const { [corpus]: _, ...others } = mix;
    setMix(weight ? { ...others, [corpus]: Number(weight) } : others);
  };
  return html`<form
    class="stack learn"
    onSubmit=${(/** @type {Event} */ event) => {
      event.preventDefault();
      const refusal = imports.refusal(name.trim());
      setError(refusal);
      if (!refusal) studio.once("learn", learn);
    }}
  >
    <h3>Learn a corpus</h3>
    <p class="hint">${count ? `From ${count} clip${count > 1 ? "s" : ""} above` : "Add files above, or mix corpora"}${
      mixed.length ? `, and ${mixed.map((one) => one.name).join(", ")}` : ""
    }.</p>
    <label class="row"><span>Name</span><input class="field grow" data-testid="corpus-name" value=${name} required maxlength="64"
      autocomplete="off" spellcheck="false" placeholder="for example, mine" onInput=${(/** @type {any} */ event) => setName(event.target.value)} /></label>
    <label class="row"><span>Description</span><input class="field grow" data-testid="corpus-title" value=${title} maxlength="200"
      onInput=${(/** @type {any} */ event) => setTitle(event.target.value)} /></label>
    <details>
      <summary>Mix with other corpora${mixed.length ? ` (${mixed.length})` : ""}</summary>
      ${imports.corpora.map(
        (corpus) => html`<label class="row" key=${corpus.name}><span class="grow cut" title=${corpus.title}>${corpus.name}</span>
          <select data-testid="mix-${corpus.name}" value=${mix[corpus.name] ?? ""}
            onChange=${(/** @type {any} */ event) => weigh(corpus.name, event.target.value)}>
            <option value="">not at all</option>
            ${WEIGHTS.map(([weight, words]) => html`<option value=${weight}>${words}</option>`)}
          </select></label>`,
      )}
    </details>
    <label class="check"><input type="checkbox" data-testid="mirror" checked=${mirror}
      onChange=${(/** @type {any} */ event) => setMirror(event.target.checked)} />Also learn the mirror image</label>
    ${error && html`<p class="said error" role="alert" data-testid="learn-error">${error}</p>`}
    ${!busy && html`<button class="button primary" data-testid="learn" disabled=${!ready}>Learn</button>`}
    ${job && html`<${Progress} studio=${studio} job=${job} busy=${busy} />`}
  </form>`;
}

/** @param {{studio: any, job: any, busy: boolean}} props */
function Progress({ studio, job, busy }) {
  const { state, done, of, words, result } = job;
  if (busy) {
    return html`<div class="stack" data-testid="learning">
      <progress value=${of ? done : null} max=${of || 1} aria-label="Learning"></progress>
      <div class="row"><span class="grow hint" aria-live="polite">${state === "waiting" ? "waiting" : words || "starting"}</span>
        <button type="button" class="button" data-testid="cancel-learning"
          onClick=${() => studio.act(() => studio.api.delete(`/api/jobs/${job.id}`))}>Cancel</button></div>
    </div>`;
  }
  if (state === "done" && result) {
    return html`<div class="stack" role="status" data-testid="learned">
      <p>Learned ${result.name}: ${result.clips} clips, ${result.postures} postures.</p>
      ${result.notes.map((/** @type {string} */ note) => html`<p class="said warning">⚠ ${note}</p>`)}
      <button type="button" class="button" data-testid="use-learned"
        onClick=${() => studio.act(() => studio.api.edit({ edit: "corpus", name: result.name }))}>Use it for this piece</button>
    </div>`;
  }
  return html`<p class=${state === "failed" ? "said error" : "hint"} role="status" data-testid="learn-ended">${
    state === "failed" ? words : "Cancelled: nothing was learned."
  }</p>`;
}
