/** Export: a film, files for other programs, the project, or a page that plays by itself. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";
import { filmingOf, nameOf, offer } from "./filming.js";
import { Sheet } from "./sheet.js";
import { Versions } from "./versions.js";

const GROUP_FILES = [
  { format: "html", testid: "export-html", name: "Web page", words: "All dancers in one file to send: it plays in any browser, without the studio." },
  { format: "glb", testid: "export-glb", name: "GLB", words: "All dancers in one file, for Blender and the web." },
  { format: "bvh", testid: "export-bvh", name: "BVH", words: "A file for each dancer, in metres, in an archive (ZIP)." },
  { format: "toml", testid: "export-toml", name: "Ensemble", words: "The ensemble's TOML file and its movement (ZIP), for the command line." },
];
const FILES = [
  { format: "html", testid: "export-html", name: "Web page", words: "One file to send: it plays in any browser, without the studio." },
  { format: "glb", testid: "export-glb", name: "GLB", words: "Body and movement, for Blender and the web." },
  { format: "bvh", testid: "export-bvh", name: "BVH", words: "Movement in metres, for Blender (tick Update Scene FPS on import) and other animation programs." },
  { format: "json", testid: "export-json", name: "Motion", words: "Everything MotionMind knows about the movement, for Python and the command line." },
];

/** @param {{studio: any}} props */
export function Panel({ studio }) {
  const { store } = studio;
  const empty = useChange(store, () => !store.state?.piece?.blocks.length);
  const file = useChange(store, () => store.state?.file ?? "");
  const several = useChange(store, () => Boolean(store.state?.cast.dancers.length));
  const [files, from] = several ? [GROUP_FILES, "/api/ensemble"] : [FILES, "/api/export"];
  return html`<div class="stack" data-testid="export">
    <h2>Export</h2>
    ${
      empty
        ? html`<p class="empty">The piece is empty. Go from A to B or add a clip to the time line, then export here.</p>`
        : html`${files.map(
            ({ format, testid, name, words }) => html`<${Format} key=${format} name=${name} words=${words}>
              <${Save} studio=${studio} path=${() => `${from}/${format}`} testid=${testid} />
            <//>`,
          )}
          ${several && html`<${Format} name="Motion" words=${FILES[3].words}><${Save} studio=${studio} path=${() => "/api/export/json"} testid="export-json" /><//>`}
          <${Film} studio=${studio} />
          <${Sheet} studio=${studio} Save=${Save} />
          <${Credits} studio=${studio} />`
    }
    <${Versions} studio=${studio} />
    <${Format} name="Project" words="The piece with every edit; open it with motionmind studio FILE. It is always saved in ${file}">
      <${Save} studio=${studio} path=${() => "/api/export/project"} testid="export-project" />
    <//>
  </div>`;
}

/** Whose movement the piece contains, and what limits sharing it. @param {any} props */
export function Credits({ studio }) {
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
function Format({ name, words, children }) {
  return html`<section class="card way">
    <div>
      <h3>${name}</h3>
      <p class="hint">${words}</p>
    </div>
    ${children}
  </section>`;
}

/** A button that downloads a file. @param {any} props */
function Save({ studio, path, testid, label = "Save" }) {
  const [busy, setBusy] = useState(false);
  const save = async () => {
    setBusy(true);
    await studio.act(async () => {
      const answer = await studio.api.file(path());
      offer(await answer.blob(), nameOf(answer) ?? "piece");
    });
    setBusy(false);
  };
  return html`<button class="button" data-testid=${testid} disabled=${busy} onClick=${save}>${busy ? "Making…" : label}</button>`;
}

/** A film continues while another panel is open; the bar leads back here. @param {{studio: any}} props */
function Film({ studio }) {
  const filming = filmingOf(studio);
  const share = useChange(filming, () => filming.share);
  return html`<${Format} name="Film" words="The whole piece, seen from where the viewer looks now (MP4).">
    ${
      share === null
        ? html`<button class="button" data-testid="export-film" onClick=${() => filming.make()}>Film</button>`
        : html`<progress value=${share} aria-label="Film"></progress>
            <button class="button" data-testid="stop-film" onClick=${() => filming.stop()}>Stop</button>`
    }
  <//>`;
}
