/** The projects opened last, to go on with one of them. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";

/** @param {{studio: any}} props */
export function Recent({ studio }) {
  const [projects, setProjects] = useState(/** @type {{id: string, name: string, folder: string, opened: number}[]} */ ([]));
  const [opening, setOpening] = useState("");
  useEffect(() => {
    studio.api.get("/api/recent").then(setProjects, () => {}); // the store reports errors
  }, []);
  const open = (/** @type {string} */ id) =>
    studio.once("open a project", async () => {
      setOpening(id);
      try {
        await studio.api.post("/api/recent", { id });
        studio.say("Opened in another tab.");
      } finally {
        setOpening("");
      }
    });
  if (projects.length === 0) return null;
  return html`<h2 id="recent">Your latest pieces</h2>
    <ul aria-labelledby="recent" data-testid="recent">
      ${projects.map(
        ({ id, name, folder, opened }) =>
          html`<li key=${id}>
            <button class="button quiet" title=${folder} disabled=${opening !== ""} onClick=${() => open(id)}>
              <span class="cut">${name}</span><span class="hint">${opening === id ? "opening…" : new Date(1000 * opened).toLocaleDateString()}</span>
            </button>
          </li>`,
      )}
    </ul>`;
}
