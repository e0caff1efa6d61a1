/** The ruler, in seconds and counts, and the playhead over all tracks. */

import { html, useEffect, useRef } from "../vendor/htm-preact-standalone.js";
import { clock, countAt, countFrom, countTicks, secondTicks } from "./scale.js";

const KEY_STEP_S = 0.1; // of the playhead, for an arrow key

/** @param {{does: any, sight: any, seconds: number, meter: import("./scale.js").Meter}} props */
export function Ruler({ does, sight, seconds, meter }) {
  const [from, to] = [sight.left / sight.scale, (sight.left + sight.width) / sight.scale];
  const end = Math.max(seconds, to);
  const element = useRef(null);
  useEffect(() => does.onTime((time) => {
    const { current } = element;
    if (!current) return;
    current.setAttribute("aria-valuenow", time.toFixed(2));
    current.setAttribute("aria-valuetext", `${clock(time)} seconds, ${countAt(time, meter)}`);
  }), [does, meter]);
  const scrub = (event) => {
    if (event.button !== 0) return;
    const { currentTarget: ruler } = event;
    ruler.setPointerCapture(event.pointerId);
    does.seek(does.near(timeAt(event, ruler, does)));
  };
  const drag = (event) => {
    if (event.currentTarget.hasPointerCapture(event.pointerId)) does.seek(does.near(timeAt(event, event.currentTarget, does)));
  };
  const key = (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const steps = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1 };
    const counts = { PageUp: 1, PageDown: -1 };
    let to_ = { Home: 0, End: seconds }[event.key] ?? (event.key in counts ? countFrom(does.time, counts[event.key], meter) : null);
    if (event.key in steps) to_ = does.sight.snaps ? countFrom(does.time, steps[event.key], meter) : does.time + steps[event.key] * KEY_STEP_S;
    if (to_ === null) return;
    event.preventDefault();
    event.stopPropagation();
    does.seek(Math.min(Math.max(to_, 0), seconds));
    does.reveal(does.time, 0);
  };
  return html`<div
    class="ruler"
    ref=${element}
    role="slider"
    tabindex="0"
    data-testid="ruler"
    aria-label="Playhead"
    aria-valuemin="0"
    aria-valuemax=${seconds.toFixed(2)}
    aria-valuenow="0"
    onPointerDown=${scrub}
    onPointerMove=${drag}
    onKeyDown=${key}
  >
    ${secondTicks(from, Math.min(to, end), sight.scale).map(
      ({ at, label }) => html`<span key=${`s${label}`} class="second" style=${{ left: `${at * sight.scale}px` }}>${label}</span>`,
    )}
    ${countTicks(from, Math.min(to, end), sight.scale, meter).map(
      ({ at, label, strong }) => html`<span
        key=${`c${at}`}
        class=${strong ? "count strong" : "count"}
        style=${{ left: `${at * sight.scale}px` }}
        >${label}</span
      >`,
    )}
  </div>`;
}

/** The playhead, which moves itself: the tracks need no rendering while the piece plays. */
export function Playhead({ does, scale }) {
  const element = useRef(null);
  useEffect(() => does.onTime((time) => {
    if (element.current) element.current.style.transform = `translateX(${time * does.sight.scale}px)`;
  }), [does]);
  return html`<div class="playhead" aria-hidden="true" ref=${element} style=${{ transform: `translateX(${does.time * scale}px)` }}></div>`;
}

function timeAt(event, ruler, does) {
  const x = event.clientX - ruler.getBoundingClientRect().left;
  return Math.min(Math.max(x / does.sight.scale, 0), does.piece.seconds);
}
