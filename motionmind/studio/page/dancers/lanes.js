/** Lanes under the time line: when each dancer enters and ends, and the changes of formation; dragged, or by keys. */

import { html, useEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";
import { castOf } from "./cast.js";
import { Drag, movedEntry, retimed, STEPS } from "./entries.js";

const BORDER_PX = 5; // of a lane's bar, at its left, as in dancers.css
const ROWS = [
  { shown: ["←", "→", "↓", "↑"], does: "enter, or change formation, a count earlier or later (or drag)", group: "Dancers" },
  { shown: ["Page ↑", "Page ↓"], does: "eight counts", group: "Dancers" },
  { shown: ["Enter"], does: "hide or show the dancer", group: "Dancers" },
];

/** Children are lanes on the same clock. @param {{does: any, sight: any, children?: any}} props */
export function Lanes({ does, sight, children }) {
  const { studio } = does;
  const cast = castOf(studio);
  useChange(cast, () => cast.version);
  const { data } = cast;
  const dancers = data?.dancers ?? [];
  const { changes } = cast.now;
  const drag = useRef(/** @type {Drag | null} */ (null));
  const [draft, setDraft] = useState(/** @type {{name: string, count: number} | null} */ (null));
  useEffect(() => studio.keys.add(ROWS), [studio]);
  if (!data || dancers.length === 0) return null;

  const x = (/** @type {number} */ time) => time * sight.scale;
  /** What is at a name: its count, and the edit that moves it there. @param {string} name */
  const item = (name) => {
    const change = name.startsWith("/") ? changes[Number(name.slice(1))] : undefined;
    if (change) return { count: change.at, move: (/** @type {number} */ count) => cast.form((all) => retimed(all, Number(name.slice(1)), count)) };
    const entry = cast.now.dancers.find(({ id }) => id === name)?.entry ?? 1;
    return { count: entry, move: (/** @type {number} */ count) => cast.change(name, () => ({ entry: count })) };
  };
  const nameOf = (/** @type {Event} */ event) => /** @type {any} */ (event.target).closest?.("[data-lane]")?.dataset.lane;
  const down = (/** @type {any} */ event) => {
    const name = nameOf(event);
    if (event.button !== 0 || event.target.closest("button")) return;
    if (!name) return;
    event.currentTarget.setPointerCapture(event.pointerId);
    drag.current = new Drag(name, item(name).count, event.clientX);
  };
  const moved = (/** @type {any} */ event) => {
    if (drag.current) setDraft(drag.current.take(event.clientX, cast.timeOf(2) * sight.scale));
  };
  const up = async (/** @type {any} */ event) => {
    const ending = drag.current;
    drag.current = null;
    if (!ending) return;
    const end = ending.take(event.clientX, cast.timeOf(2) * sight.scale);
    if (end) await item(ending.name).move(end.count);
    else cast.seek(Math.min(Math.max((event.clientX - event.currentTarget.getBoundingClientRect().left) / sight.scale, 0), data.seconds));
    setDraft(null);
  };
  const cancel = () => {
    drag.current = null;
    setDraft(null);
  };
  const key = (/** @type {KeyboardEvent} */ event) => {
    const name = nameOf(event);
    if (!name || event.altKey || event.ctrlKey || event.metaKey) return;
    if (event.key === "Escape") return cancel();
    const step = STEPS[event.key];
    if (step !== undefined) {
      if (name.startsWith("/")) cast.form((all) => retimed(all, Number(name.slice(1)), movedEntry(all[Number(name.slice(1))].at, step)));
      else cast.change(name, ({ entry }) => ({ entry: movedEntry(entry, step) }));
    } else if (event.key === "Enter" && !name.startsWith("/")) cast.toggle(name);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const slider = (/** @type {string} */ name, /** @type {string} */ label, /** @type {number} */ count) => ({
    role: "slider",
    tabindex: 0,
    "data-lane": name,
    "aria-label": label,
    "aria-valuemin": 1,
    "aria-valuemax": 100000,
    "aria-valuenow": count,
    "aria-valuetext": `count ${rounded(count)}`,
  });
  return html`<div class="lanes" role="group" aria-label="Dancers" data-testid="lanes" onKeyDown=${key}
    onPointerDown=${down} onPointerMove=${moved} onPointerUp=${up} onPointerCancel=${cancel}>
    ${children}
    ${
      changes.length > 0 &&
      html`<div class="track lane formations">
        ${changes.map((change, i) => {
          const at = draft?.name === `/${i}` ? draft.count : change.at;
          const words = change.formation ?? "places";
          return html`<div key=${i} class="formation" data-testid=${`formation-${i}`} title=${`${words}, count ${rounded(at)}`}
            ...${slider(`/${i}`, `Change of formation to ${words}`, at)}
            style=${{ left: `${x(cast.timeOf(at))}px`, width: `${x(cast.timeOf(1 + change.counts))}px` }}><span class="cut">${words}</span></div>`;
        })}
      </div>`
    }
    ${dancers.map((dancer) => {
      const now = cast.now.dancers.find(({ id }) => id === dancer.id)?.entry ?? cast.countAt(dancer.entry);
      const entry = draft?.name === dancer.id ? draft.count : now;
      const begin = cast.timeOf(entry);
      const hidden = cast.hidden.has(dancer.id);
      const colour = `rgb(${dancer.colour.join()})`;
      return html`<div key=${dancer.id} class=${hidden ? "track lane gone" : "track lane"}>
        <div class="danced" data-testid=${`lane-${dancer.id}`} title=${`${dancer.name} enters at count ${rounded(entry)}`}
          ...${slider(dancer.id, `${dancer.name} enters${dancer.mirrored ? ", mirrored" : ""}${hidden ? ", hidden" : ""}`, entry)}
          style=${{ left: `${x(begin)}px`, width: `${Math.max(x(dancer.end - dancer.entry), 12)}px`, borderColor: colour }}>
          ${dancer.ways.map(
            ([from, to]) => to > dancer.entry && html`<i class="way" style=${{ left: `${x(Math.max(from, dancer.entry) - dancer.entry) - BORDER_PX}px`, width: `${x(to - Math.max(from, dancer.entry))}px` }}></i>`,
          )}
        </div>
        <button class="button quiet who" tabindex="-1" aria-pressed=${String(!hidden)} data-testid=${`show-${dancer.id}`}
          title=${`${hidden ? "Show" : "Hide"} ${dancer.name} (Enter)`} onClick=${() => cast.toggle(dancer.id)}>
          <i class="swatch" style=${{ background: hidden ? "transparent" : colour, borderColor: colour }}></i><span class="cut">${dancer.name}</span>${dancer.mirrored && html`<span class="hint">mirrored</span>`}
        </button>
      </div>`;
    })}
    <${Moment} studio=${studio} scale=${sight.scale} />
  </div>`;
}

/** The playhead of all dancers, whose time goes on while the piece waits. @param {{studio: any, scale: number}} props */
function Moment({ studio, scale }) {
  const line = useRef(/** @type {any} */ (null));
  useEffect(() => {
    const { viewer } = studio;
    const follow = () => {
      if (viewer.isHome) line.current.style.transform = `translateX(${viewer.player.time * scale}px)`;
    };
    follow();
    viewer.player.addEventListener("change", follow);
    return () => viewer.player.removeEventListener("change", follow);
  }, [scale]);
  return html`<div class="moment" aria-hidden="true" ref=${line}></div>`;
}

/** @param {number} count */
function rounded(count) {
  return String(Math.round(count * 100) / 100);
}
