/** What the viewer shows besides the body: trails, onion skin and the legend of colours. The browser keeps the choice. */

import { writeLegend } from "motionmind/legend";
import { html, useEffect, useLayoutEffect, useRef } from "../vendor/htm-preact-standalone.js";
import { perStudio, useChange, useKeys } from "../shell/hooks.js";
import { StageFields, useArea } from "./area.js";

const KEPT = "motionmind-sights"; // its name in the browser
const GROUP = "Viewer";
const PARTS = ["hands", "feet", "pelvis"];
const DISTANCES = [1, 2, 3, 5, 10, 20, 50]; // frames between two ghosts
/** @typedef {{trails: string[], onion: boolean, apart: number, open: boolean, colours: boolean}} Choice */
/** @type {Choice} */
const USUAL = { trails: [], onion: false, apart: 5, open: false, colours: false };

const sightsOf = perStudio(({ viewer }) => new Choices(viewer));

/** Fires "change". */
class Choices extends EventTarget {
  /** @param {import("../viewer.js").Viewer} viewer */
  constructor(viewer) {
    super();
    this.viewer = viewer;
    /** @type {Choice} */
    this.now = { ...USUAL, ...kept() };
    this.#apply();
  }

  /** @param {Partial<Choice>} change */
  set(change) {
    this.now = { ...this.now, ...change };
    localStorage.setItem(KEPT, JSON.stringify(this.now));
    this.#apply();
    this.dispatchEvent(new Event("change"));
  }

  /** Draw a part's trail, or no longer. @param {string} part */
  trail(part) {
    this.set({ trails: PARTS.filter((one) => (one === part) !== this.now.trails.includes(one)) });
  }

  #apply() {
    const { trails, onion, apart } = this.now;
    this.viewer.besides({ trails, onion: onion ? apart : 0 });
  }
}

/** The choice that the browser has kept, as far as it is one. @returns {Partial<Choice>} */
function kept() {
  try {
    const { trails, onion, apart, open, colours } = JSON.parse(localStorage.getItem(KEPT) ?? "");
    return {
      trails: PARTS.filter((part) => trails.includes(part)),
      onion: onion === true,
      apart: DISTANCES.includes(apart) ? apart : USUAL.apart,
      open: open === true,
      colours: colours === true,
    };
  } catch {
    return {};
  }
}

/** The corner of the viewer that chooses. @param {{studio: any}} props */
export function Sights({ studio }) {
  const sights = sightsOf(studio);
  const { trails, onion, apart, open, colours } = useChange(sights, () => sights.now);
  const motion = useChange(studio.viewer, () => studio.viewer.motion, "show");
  useArea(studio);
  const toggle = (/** @type {"onion" | "open" | "colours"} */ name) => sights.set({ [name]: !sights.now[name] });
  useKeys(studio, [
    ...PARTS.map((part) => ({
      keys: [`Shift+${part[0]}`],
      does: part === "pelvis" ? "trail of the pelvis" : `trails of the ${part}`,
      group: GROUP,
      act: () => sights.trail(part),
    })),
    { keys: ["o"], does: "onion skin: frames before and after", group: GROUP, act: () => toggle("onion") },
    { keys: ["c"], does: "legend of the colours", group: GROUP, act: () => toggle("colours") },
  ]);
  if (!motion) return null;
  const several = Boolean(motion.dancers); // whose trails and ghosts would hide each other
  return html`<div class="sights">
    ${colours && html`<${Legend} viewer=${studio.viewer} />`}
    ${
      open &&
      html`<div class="card choices" id="sights" role="group" aria-label="Shown besides the body">
        <div class="row" role="group" aria-label="Trails">
          <span class="hint">Trails</span>
          ${PARTS.map((part) =>
            button(trails.includes(part), `trail-${part}`, capital(part), `Trails (Shift ${capital(part[0])})`, () => sights.trail(part), several || !motion.body.trails[part].length),
          )}
        </div>
        <div class="row">
          ${button(onion, "onion", "Onion skin", "Frames before and after (O)", () => toggle("onion"), several)}
          <select
            aria-label="Frames between two ghosts"
            value=${apart}
            onChange=${(/** @type {any} */ event) => sights.set({ apart: Number(event.target.value), onion: true })}
          >
            ${DISTANCES.map((frames) => html`<option value=${frames}>${frames} frame${frames === 1 ? "" : "s"} apart</option>`)}
          </select>
        </div>
        ${!studio.api.looks && html`<${StageFields} studio=${studio} />`}
      </div>`
    }
    <div class="row">
      <button class="button quiet" data-testid="sights" aria-expanded=${String(open)} aria-controls=${open ? "sights" : undefined}
        title="Trails, onion skin and the stage" onClick=${() => toggle("open")}>Show</button>
      <button class="button quiet" data-testid="colours" aria-expanded=${String(colours)} title="Legend of the colours (C)"
        onClick=${() => toggle("colours")}>Colours</button>
    </div>
  </div>`;
}

/** @param {boolean} pressed @param {string} test @param {string} words @param {string} title @param {() => void} act @param {boolean} disabled */
function button(pressed, test, words, title, act, disabled = false) {
  return html`<button class="button" data-testid=${test} aria-pressed=${String(pressed)} title=${title} disabled=${disabled} onClick=${act}>
    ${words}
  </button>`;
}

/** The colours of what is shown. @param {{viewer: any}} props */
function Legend({ viewer }) {
  const list = useRef(/** @type {any} */ (null));
  const write = () => {
    list.current.replaceChildren();
    if (viewer.motion) writeLegend(list.current, viewer.motion.painted ?? viewer.motion, viewer.motion.body, viewer.motion.colours);
  };
  useLayoutEffect(write, []);
  useEffect(() => {
    viewer.addEventListener("show", write); // also when the same movement has grown
    return () => viewer.removeEventListener("show", write);
  }, []);
  return html`<ul ref=${list} class="legend" data-testid="legend" aria-label="Colours"></ul>`;
}

/** @param {string} word */
function capital(word) {
  return word[0].toUpperCase() + word.slice(1);
}
