/** Named versions of the piece: keep one, see what has changed since, go back. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";

/** @typedef {{name: string, seconds: number, changes: string[]}} Version */

/** @param {{studio: any}} props */
export function Versions({ studio }) {
  const revision = useChange(studio.store, () => studio.store.state);
  const [versions, setVersions] = useState(/** @type {Version[]} */ ([]));
  const [name, write] = useState("");
  useEffect(() => {
    let here = true;
    studio.api.get("/api/versions").then((/** @type {Version[]} */ found) => here && setVersions(found), () => {});
    return () => (here = false);
  }, [revision]);
  const edit = (/** @type {object} */ change) => studio.act(() => studio.api.edit(change));
  const keep = async (/** @type {Event} */ event) => {
    event.preventDefault();
    const wanted = name.trim();
    if (wanted && (await edit({ edit: "version", name: wanted }))) write("");
  };
  return html`<section class="card stack versions" data-testid="versions">
    <h3>Versions</h3>
    <form class="row" onSubmit=${keep}>
      <input class="field grow" data-testid="version-name" aria-label="Name of the version" placeholder="Before rehearsal" maxlength="200"
        autocomplete="off" value=${name} onInput=${(/** @type {any} */ event) => write(event.target.value)} />
      <button class="button" data-testid="version-keep" disabled=${!name.trim()}>Keep</button>
    </form>
    ${versions.map(
      (version) => html`<div class="stack" role="group" key=${version.name} aria-label=${version.name}>
        <div>
          <strong>${version.name}</strong>${" "}<span class="hint numbers">${version.seconds.toFixed(1)} s</span>
          <p class="hint" data-testid="version-changes">${version.changes.length ? `Since then: ${version.changes.join(", ")}.` : "As the piece is now."}</p>
        </div>
        <div class="row">
          <button class="button" data-testid="version-back" disabled=${!version.changes.length}
            aria-label=${`Go back to ${version.name}`} onClick=${() => edit({ edit: "goback", name: version.name })}>Go back</button>
          <button class="button quiet" data-testid="version-delete" aria-label=${`Delete ${version.name}`}
            onClick=${() => edit({ edit: "version", name: version.name, keep: false })}>Delete</button>
        </div>
      </div>`,
    )}
  </section>`;
}
