/** Assemble the page: the `studio` object that every panel gets, and the layout of the panels. */

import { html, render, useLayoutEffect, useRef } from "./vendor/htm-preact-standalone.js";
import { api, pictured } from "./begin.js";
import * as between from "./between/panel.js";
import * as dancers from "./dancers/panel.js";
import * as take from "./export/panel.js";
import * as movement from "./imports/panel.js";
import { Looking } from "./look/page.js";
import * as pose from "./pose/panel.js";
import { Bar } from "./shell/bar.js";
import { useChange } from "./shell/hooks.js";
import { icon } from "./shell/icons.js";
import { followKeyboard } from "./shell/keyboard.js";
import { Keys } from "./shell/keys.js";
import { oncer } from "./shell/once.js";
import { View } from "./shell/stage.js";
import { Shown, Toasts } from "./shell/toasts.js";
import { Store } from "./store.js";
import { Panel as Timeline } from "./timeline/panel.js";
import * as vary from "./vary/panel.js";
import { Viewer } from "./viewer.js";

/** The panels in their order on the rail: labels and views. */
const PANELS = [
  { name: "between", words: "A to B", about: "From one posture to another", views: between },
  { name: "vary", words: "Variations", about: "The piece in another order", views: vary },
  { name: "pose", words: "Pose", about: "Pose a body by hand", views: pose },
  { name: "dancers", words: "Dancers", about: "Several dancers of the piece", views: dancers },
  { name: "movement", words: "Movement", about: "Your own movement, and corpora", views: movement },
  { name: "take", words: "Export", about: "Export the piece: film, Blender, web page", views: take },
];

class Open extends EventTarget {
  panel = PANELS[0].name;

  /** @param {string} name */
  set(name) {
    this.panel = name;
    this.dispatchEvent(new Event("change"));
  }
}

/** @param {{studio: any, open: Open}} props */
function Studio({ studio, open }) {
  const name = useChange(open, () => open.panel);
  const { views, about } = PANELS.find((panel) => panel.name === name) ?? PANELS[0];
  const Centre = "Centre" in views ? views.Centre : null;
  const aside = useRef(/** @type {any} */ (null));
  useLayoutEffect(() => (aside.current.scrollTop = 0), [name]); // each panel starts at the top
  return html`<${Bar} studio=${studio} />
    <${Rail} name=${name} open=${open} />
    <aside ref=${aside} class="panel" aria-label="Panel">
      <div id="panel" role="tabpanel" aria-label=${about} data-testid=${`panel-${name}`}>
        <${views.Panel} key=${name} studio=${studio} />
      </div>
    </aside>
    <main class="view" aria-label="Viewer">
      <${View} studio=${studio} />
      ${Centre && html`<${Centre} key=${name} studio=${studio} />`}
    </main>
    <div class="strip"><${Timeline} studio=${studio} /></div>
    <${Shown} toasts=${studio.toasts} />`;
}

/** Tabs of the panels: one Tab stop, and arrow keys move between them. @param {{name: string, open: Open}} props */
function Rail({ name, open }) {
  const move = (/** @type {KeyboardEvent} */ event) => {
    const by = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    const at = PANELS.findIndex((panel) => panel.name === name);
    const next = PANELS[(at + by + PANELS.length) % PANELS.length].name;
    open.set(next);
    document.getElementById(`open-${next}`)?.focus();
  };
  return html`<nav class="rail" aria-label="Panels">
    <div role="tablist" aria-label="Panels" aria-orientation="vertical" onKeyDown=${move}>
    ${PANELS.map(
      (panel) =>
        html`<button
          id=${`open-${panel.name}`}
          data-testid=${`open-${panel.name}`}
          role="tab"
          aria-selected=${String(panel.name === name)}
          aria-controls="panel"
          tabindex=${panel.name === name ? 0 : -1}
          title=${panel.about}
          onClick=${() => open.set(panel.name)}
        >
          ${icon(panel.name)}${panel.words}
        </button>`,
    )}
    </div>
  </nav>`;
}

const PICTURES_TIMEOUT_MS = 3000; // the 3D view waits this long for the thumbnails

/** Wait until the page is painted. */
function painted() {
  return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
}

async function start() {
  const shown = Promise.race([pictured.then(painted), new Promise((done) => setTimeout(done, PICTURES_TIMEOUT_MS))]);
  followKeyboard();
  const open = new Open();
  const toasts = new Toasts();
  const keys = new Keys();
  const store = new Store(api);
  const viewer = new Viewer();
  /** Run an action; show its error in one line. @param {() => Promise<any>} doing */
  const act = async (doing) => {
    try {
      return await doing();
    } catch (error) {
      toasts.say(error instanceof Error ? error.message : String(error), { kind: "error" });
      return undefined;
    }
  };
  const studio = {
    api,
    store,
    viewer,
    toasts,
    keys,
    window: api.window,
    /** Wait, briefly, until the first thumbnails are painted. @returns {Promise<unknown>} */
    pictured: () => shown,
    open: (/** @type {string} */ panel) => open.set(panel),
    say: toasts.say.bind(toasts),
    act,
    /** Like `act`, but ignore a repeat with the same name while it runs: for buttons and keys. */
    once: oncer(act),
  };
  Object.assign(window, { studio }); // for tests and the console
  const root = /** @type {Element} */ (document.getElementById("studio"));
  root.classList.toggle("looking", api.looks);
  render(html`<${api.looks ? Looking : Studio} studio=${studio} open=${open} />`, root);
  /** @type {string[]} */
  let noticed = [];
  /** @type {string[]} */
  let missed = [];
  store.addEventListener("change", () => {
    const words = store.state?.words ?? [];
    for (const notice of words) if (!noticed.includes(notice)) studio.say(notice, { kind: "error" });
    const holds = [...words, ...(store.state?.missing ?? [])];
    for (const notice of [...noticed, ...missed]) if (!holds.includes(notice)) toasts.withdraw(notice);
    noticed = words;
  });
  store.addEventListener("back", () => {
    for (const words of api.faults) toasts.withdraw(words);
    api.faults.clear();
  });
  await studio.act(() => store.start());
  missed = store.state?.missing ?? [];
  for (const words of missed) studio.say(words, { kind: "error" });
}

start();
