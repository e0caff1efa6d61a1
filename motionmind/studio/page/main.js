/** The page put together: what every panel gets as `studio`, and where each panel stands. */

import { html, render, useLayoutEffect, useRef } from "./vendor/htm-preact-standalone.js";
import { api, pictured } from "./begin.js";
import * as between from "./between/panel.js";
import * as take from "./export/panel.js";
import * as movement from "./imports/panel.js";
import * as pose from "./pose/panel.js";
import { Bar } from "./shell/bar.js";
import { useChange } from "./shell/hooks.js";
import { icon } from "./shell/icons.js";
import { Keys } from "./shell/keys.js";
import { oncer } from "./shell/once.js";
import { View } from "./shell/stage.js";
import { Shown, Toasts } from "./shell/toasts.js";
import { Store } from "./store.js";
import { Panel as Timeline } from "./timeline/panel.js";
import * as vary from "./vary/panel.js";
import { Viewer } from "./viewer.js";

/** The panels by name, in their order on the rail: what each is called, and its views. */
const PANELS = [
  { name: "between", words: "A to B", about: "From one posture to another", views: between },
  { name: "vary", words: "Variations", about: "The piece in another order", views: vary },
  { name: "pose", words: "Pose", about: "A posture, moved by hand", views: pose },
  { name: "movement", words: "Movement", about: "One's own movement, and corpora", views: movement },
  { name: "take", words: "Take away", about: "Film, Blender, a page: take the piece away", views: take },
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
  useLayoutEffect(() => (aside.current.scrollTop = 0), [name]); // where the panel before was scrolled to is not where this begins
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

/** The five panels, one stop of the Tab key; arrows lead on. @param {{name: string, open: Open}} props */
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

const LONGEST = 3000; // milliseconds that the body waits for the small pictures

/** Wait until what is on the page now is painted. */
function painted() {
  return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
}

async function start() {
  const shown = Promise.race([pictured.then(painted), new Promise((done) => setTimeout(done, LONGEST))]);
  const open = new Open();
  const toasts = new Toasts();
  const keys = new Keys();
  const store = new Store(api);
  const viewer = new Viewer();
  /** Do something that may fail, and say in one line why it did. @param {() => Promise<any>} doing */
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
    /** Wait until the first small pictures are painted, but not for long. @returns {Promise<unknown>} */
    pictured: () => shown,
    open: (/** @type {string} */ panel) => open.set(panel),
    say: toasts.say.bind(toasts),
    act,
    /** As `act`, but not again while the same, by its name, is being done: for what a button or a key begins. */
    once: oncer(act),
  };
  Object.assign(window, { studio }); // for tests, and for whoever is curious
  render(html`<${Studio} studio=${studio} open=${open} />`, /** @type {Element} */ (document.getElementById("studio")));
  await studio.act(() => store.start());
  for (const words of store.state?.words ?? []) studio.say(words);
  for (const words of store.state?.missing ?? []) studio.say(words, { kind: "error" });
}

start();
