/** The middle of the page: the viewer, its caption and views, and the transport. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { FloorTools } from "../asks/floor.js";
import { Asked } from "../asks/scene.js";
import { Pane } from "../reference/pane.js";
import { useStore } from "../store.js";
import { Sights } from "../view/sights.js";
import { useChange, useKeys } from "./hooks.js";
import { icon } from "./icons.js";

const VIEWS = [
  ["front", "Front", "From the audience (1)"],
  ["side", "Side", "From stage right (2)"],
  ["top", "Top", "From above (3)"],
  ["quarter", "Quarter", "Three-quarter view (4)"],
];
const SPEEDS = [0.1, 0.25, 0.5, 0.75, 1, 1.5, 2];
const GROUP = "Viewer";

/** @param {{studio: any}} props */
export function View({ studio }) {
  const { viewer } = studio;
  const { player } = viewer;
  const place = useRef(/** @type {any} */ (null));
  useLayoutEffect(() => place.current.prepend(viewer.element), []);
  const home = useChange(viewer, () => viewer.isHome, "show");
  const title = useChange(viewer, () => viewer.title, "show");
  const piece = useChange(viewer, () => viewer.piece, "show");
  const path = useStore(studio, ({ state }) => state?.reference.path) ?? "";
  const [beside, setBeside] = useState(false);
  useEffect(() => setBeside(path !== ""), [path]);
  useKeys(studio, [
    { keys: [" "], does: "play or pause", group: GROUP, act: () => player.toggle() },
    { keys: ["ArrowLeft"], does: "one frame back", group: GROUP, act: () => player.step(-1) },
    { keys: ["ArrowRight"], does: "one frame forward", group: GROUP, act: () => player.step(1) },
    { keys: ["Home"], does: "go to the start", group: GROUP, act: () => player.seek(player.motion.start) },
    { keys: ["End"], does: "go to the end", group: GROUP, act: () => player.seek(player.motion.end) },
    { keys: ["l"], does: "loop", group: GROUP, act: () => (player.loop = !player.loop) },
    ...(studio.api.looks ? [] : [{ keys: ["v"], does: "show or hide the reference video", group: GROUP, act: () => setBeside(!beside) }]),
    ...VIEWS.map(([view, , words], i) => ({
      keys: [String(i + 1)],
      does: words.replace(/ \(.*/, "").toLowerCase(),
      group: GROUP,
      act: () => viewer.look(view),
    })),
    { shown: ["Shift", "arrows"], does: "rotate the view (or drag)", group: GROUP },
    { shown: ["+", "-"], does: "zoom (or scroll)", group: GROUP },
    { keys: ["Escape"], does: "back to the piece", group: GROUP, act: () => (viewer.isHome ? false : viewer.back()) },
  ]);
  useEffect(() => {
    studio.keys.controls = () => viewer.stage?.controls;
  }, []);
  return html`<div class="pair"><div class="frame" ref=${place}>
      ${
        !home &&
        html`<div class="caption">
          ${title && html`<span class="name cut">${title}</span>`}
          ${piece && html`<button class="button" onClick=${() => viewer.back()}>${icon("back")} Back to the piece</button>`}
        </div>`
      }
      <div class="views" role="group" aria-label="View">
        ${VIEWS.map(
          ([view, name, words]) =>
            html`<button class="button quiet" title=${words} onClick=${() => viewer.look(view)}>${name}</button>`,
        )}
      </div>
      <${Sights} studio=${studio} /><${Asked} studio=${studio} /><${FloorTools} studio=${studio} />
    </div>
    ${!studio.api.looks && html`<${Pane} studio=${studio} hidden=${!beside} />`}</div>
    <${Transport} viewer=${viewer}>
      ${
        !studio.api.looks &&
        html`<button
          class="button quiet icon wide"
          data-testid="reference-toggle"
          aria-label="Reference video"
          aria-pressed=${String(beside)}
          title="Reference video (V)"
          onClick=${() => setBeside(!beside)}
        >
          ${icon("video")}
        </button>`
      }
    <//>`;
}

/** The controls that play the movement. @param {{viewer: any, children?: any}} props */
function Transport({ viewer, children }) {
  const { player } = viewer;
  const playing = useChange(player, () => player.playing);
  const loop = useChange(player, () => player.loop);
  const speed = useChange(player, () => player.speed);
  const motion = useChange(viewer, () => viewer.motion, "show");
  const moving = Boolean(motion && motion.length > 1);
  return html`<div class="transport" role="group" aria-label="Play" data-testid="transport">
    <button
      class="button icon"
      data-testid="play"
      aria-label=${playing ? "Pause" : "Play"}
      title="Play, pause (space)"
      disabled=${!moving}
      onClick=${() => player.toggle()}
    >
      ${icon(playing ? "pause" : "play")}
    </button>
    <button
      class="button quiet icon wide"
      aria-label="Loop"
      aria-pressed=${String(loop)}
      title="Loop (L)"
      onClick=${() => (player.loop = !player.loop)}
    >
      ${icon("loop")}
    </button>
    <${Scrub} viewer=${viewer} moving=${moving} />
    <select class="wide" aria-label="Speed" value=${speed} onChange=${(/** @type {any} */ event) => (player.speed = Number(event.target.value))}>
      ${SPEEDS.map((value) => html`<option value=${value}>${value}×</option>`)}
    </select>
    ${children}
  </div>`;
}

/** The time slider; it updates outside of the view, because it changes with every picture. @param {any} props */
function Scrub({ viewer, moving }) {
  const { player } = viewer;
  const line = useRef(/** @type {any} */ (null));
  const clock = useRef(/** @type {any} */ (null));
  const made = useRef(/** @type {any} */ (null));
  useEffect(() => {
    const update = () => {
      const { start, end } = player.motion;
      made.current.classList.toggle("unseen", !viewer.motion?.insertedAt(player.time));
      const span = Math.max(end - start, 1e-9);
      line.current.value = String((player.time - start) / span);
      const words = `${(player.time - start).toFixed(1)} of ${(end - start).toFixed(1)} s`;
      if (clock.current.textContent !== words) {
        clock.current.textContent = words;
        line.current.setAttribute("aria-valuetext", words);
      }
    };
    update();
    for (const target of [player, viewer]) target.addEventListener(target === player ? "change" : "show", update);
    return () => {
      for (const target of [player, viewer]) target.removeEventListener(target === player ? "change" : "show", update);
    };
  }, []);
  const seek = (/** @type {any} */ event) => {
    const { start, end } = player.motion;
    const share = Number(event.target.value); // before pausing, which resets the slider
    if (player.playing) player.pause();
    player.seek(start + share * (end - start));
  };
  return html`<input ref=${line} type="range" min="0" max="1" step="any" aria-label="Time" data-testid="scrub" disabled=${!moving} onInput=${seek} />
    <span ref=${made} class="made unseen" title="The engine made this moment; it was not recorded" data-testid="made">inserted</span>
    <span ref=${clock} class="hint numbers clock"></span>`;
}
