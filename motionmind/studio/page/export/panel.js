/** Flow 6, take it away: a film, a file for other programs, the project, or a page that plays by itself. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";
import { filmingOf, offer } from "./filming.js";

const FILES = [
  { format: "html", testid: "export-html", name: "A page", words: "One file that plays in any browser, without the studio: to send to somebody." },
  { format: "glb", testid: "export-glb", name: "GLB", words: "The body and its movement for Blender, and for the web." },
  { format: "bvh", testid: "export-bvh", name: "BVH", words: "Movement for Blender (tick Update Scene FPS as you import it) and other programs that animate; lengths are in metres." },
  { format: "json", testid: "export-json", name: "Motion", words: "All that MotionMind knows of the movement, to go on with in Python or a terminal." },
];

/** @param {{studio: any}} props */
export function Panel({ studio }) {
  const { store } = studio;
  const empty = useChange(store, () => !store.state?.piece?.blocks.length);
  const file = useChange(store, () => store.state?.file ?? "");
  return html`<div class="stack" data-testid="export">
    <h2>Take it away</h2>
    ${
      empty
        ? html`<p class="empty">The piece is empty. Go from A to B, or put a clip onto the line of time; then take it away from here.</p>`
        : html`${FILES.map(
            ({ format, testid, name, words }) => html`<${Way} key=${format} name=${name} words=${words}>
              <${Save} studio=${studio} format=${format} testid=${testid} />
            <//>`,
          )}
          <${Film} studio=${studio} />
          <${Credits} studio=${studio} />`
    }
    <${Way} name="The project" words="The piece with every edit, to open again with motionmind studio FILE. It is always saved: ${file}">
      <${Save} studio=${studio} format="project" testid="export-project" />
    <//>
  </div>`;
}

/** Whose movement the piece is made of, and what stands against passing it on. @param {any} props */
function Credits({ studio }) {
  const revision = useChange(studio.store, () => studio.store.state);
  const [sections, setSections] = useState(/** @type {{heading: string, lines: string[]}[]} */ ([]));
  useEffect(() => {
    let here = true;
    const known = (/** @type {any} */ found) => here && setSections(found.sections);
    studio.api.get("/api/credits").then(known, () => known({ sections: [] }));
    return () => (here = false);
  }, [revision]);
  return html`<details class="card credits" data-testid="credits" hidden=${sections.length === 0}
    open=${sections.some(({ heading }) => heading === "beware")}>
    <summary>Credits</summary>
    <dl>
      ${sections.map(({ heading, lines }) => html`<dt>${heading}</dt>${lines.map((line) => html`<dd>${line}</dd>`)}`)}
    </dl>
  </details>`;
}

/** @param {any} props */
function Way({ name, words, children }) {
  return html`<section class="card way">
    <div>
      <h3>${name}</h3>
      <p class="hint">${words}</p>
    </div>
    ${children}
  </section>`;
}

/** A button that fetches a file and saves it under the name that the server gives it. @param {any} props */
function Save({ studio, format, testid }) {
  const [busy, setBusy] = useState(false);
  const save = async () => {
    setBusy(true);
    await studio.act(async () => {
      const answer = await studio.api.file(`/api/export/${format}`);
      offer(await answer.blob(), nameOf(answer) ?? `piece.${format}`);
    });
    setBusy(false);
  };
  return html`<button class="button" data-testid=${testid} disabled=${busy} onClick=${save}>${busy ? "Making…" : "Save"}</button>`;
}

/** @param {Response} answer */
function nameOf(answer) {
  const encoded = /filename\*=UTF-8''([^;]+)/.exec(answer.headers.get("Content-Disposition") ?? "")?.[1];
  return encoded && decodeURIComponent(encoded);
}

/** A film goes on while another panel is open: the bar leads back here. @param {{studio: any}} props */
function Film({ studio }) {
  const filming = filmingOf(studio);
  const share = useChange(filming, () => filming.share);
  return html`<${Way} name="Film" words="The piece as the viewer shows it now, from where the camera is (WebM).">
    ${
      share === null
        ? html`<button class="button" data-testid="export-film" onClick=${() => filming.make()}>Film</button>`
        : html`<progress value=${share} aria-label="Film"></progress>
            <button class="button" data-testid="stop-film" onClick=${() => filming.stop()}>Stop</button>`
    }
  <//>`;
}
