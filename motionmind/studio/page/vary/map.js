/** The map of the attractor: the piece, the variation, and the start, which the user drags. */

import { html, useEffect, useMemo, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { useChange, useKeys } from "../shell/hooks.js";
import { Chart, draw, drawHead, points } from "./chart.js";
import { placeAt } from "./varying.js";

const STEPS = /** @type {Record<string, number>} */ ({ ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 40, PageDown: -40 });
const SHEET = [
  { shown: ["←", "→"], does: "on the map: move the start (with Shift farther)", group: "Variations" },
  { shown: ["PgUp", "PgDn"], does: "on the map: move the start far", group: "Variations" },
  { shown: ["Home"], does: "on the map: reset the start", group: "Variations" },
];
const NOTHING = new Float32Array(0);
/** @type {Map<string, Promise<{chart: Chart, about: string}>>} */
const charts = new Map();

/** @param {{get: (path: string) => Promise<any>}} api @param {string} flow */
function chartOf(api, flow) {
  const known = charts.get(flow);
  if (known) return known;
  const found = api.get(`/api/vary/map?flow=${flow}`).then((map) => ({ chart: new Chart(points(map.points), map.axes), about: map.about }));
  found.catch(() => charts.delete(flow));
  charts.set(flow, found);
  return found;
}

/**
 * @param {{studio: any, varying: import("./varying.js").Varying, piece: any, playing: boolean}} props `playing`: the
 *   viewer shows the variation, which is `piece` with its insertions
 */
export function AttractorMap({ studio, varying, piece, playing }) {
  const { viewer } = studio;
  useKeys(studio, SHEET);
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const [chart, setChart] = useState(/** @type {Chart | null} */ (null));
  const [held, setHeld] = useState(false);
  const along = useRef(0); // index of the attractor's point at the start
  const { flow } = varying.wish;
  const { proposal } = varying;
  const dark = useChange(viewer.theme, () => viewer.theme.dark);
  const shown = useMemo(
    () =>
      proposal
        ? { trail: points(proposal.trail), other: points(proposal.other), every: proposal.every, jumps: proposal.jumps }
        : { trail: NOTHING, other: NOTHING, every: 1, jumps: [] },
    [proposal],
  );

  useEffect(() => {
    let here = true;
    chartOf(studio.api, flow).then(
      (found) => here && setChart(found.chart),
      (error) => studio.say(error.message, { kind: "error" }),
    );
    return () => {
      here = false;
    };
  }, [flow]);

  useEffect(() => {
    const element = canvas.current;
    if (!element || !chart) return undefined;
    let waiting = 0;
    const inks = colours(element);
    const below = document.createElement("canvas"); // the static layer
    const pen = /** @type {CanvasRenderingContext2D} */ (element.getContext("2d"));
    const paint = () => {
      waiting = 0;
      const ratio = window.devicePixelRatio;
      const [width, height] = [element.clientWidth, element.clientHeight].map((size) => Math.round(size * ratio));
      if (!width || !height) return;
      if (below.width !== width || below.height !== height) {
        for (const sheet of [element, below]) Object.assign(sheet, { width, height });
        chart.resize(element.clientWidth, element.clientHeight);
        const under = /** @type {CanvasRenderingContext2D} */ (below.getContext("2d"));
        under.scale(ratio, ratio);
        draw(under, chart, inks, shown);
      }
      pen.setTransform(1, 0, 0, 1, 0, 0);
      pen.clearRect(0, 0, width, height);
      pen.drawImage(below, 0, 0);
      pen.scale(ratio, ratio);
      if (playing && proposal) drawHead(pen, chart, inks, shown, placeAt({ ...proposal, piece }, viewer.player.time));
    };
    const soon = () => {
      waiting ||= requestAnimationFrame(paint);
    };
    const size = new ResizeObserver(soon);
    size.observe(element);
    if (playing) viewer.player.addEventListener("change", soon);
    soon();
    return () => {
      cancelAnimationFrame(waiting);
      size.disconnect();
      viewer.player.removeEventListener("change", soon);
    };
  }, [chart, shown, dark, playing, piece]);

  const begin = (/** @type {number} */ number) => {
    if (!chart) return;
    along.current = number;
    varying.want({ start: chart.point(number) });
  };
  const drop = () => {
    setHeld(false);
    varying.drop();
  };
  const drag = (/** @type {PointerEvent} */ event) => {
    if (!chart || !canvas.current) return;
    const box = canvas.current.getBoundingClientRect();
    along.current = chart.nearest(event.clientX - box.left, event.clientY - box.top);
    varying.drag(chart.point(along.current));
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    const step = STEPS[event.key];
    if (event.key === "Home") varying.want({ start: null });
    else if (!step) return;
    else begin(along.current + step * (event.shiftKey ? 10 : 2));
    event.preventDefault();
    event.stopPropagation();
  };
  return html`<figure class="map">
    <canvas
      ref=${canvas}
      data-testid="map"
      class=${held ? "held" : ""}
      tabindex="0"
      role="slider"
      aria-label="Start of the piece on the attractor"
      aria-valuemin="0"
      aria-valuemax=${chart ? chart.all.length / 3 - 1 : 1}
      aria-valuenow=${along.current}
      aria-valuetext=${varying.wish.start ? varying.wish.start.map((x) => x.toFixed(1)).join(", ") : "default"}
      aria-describedby="map-hint"
      onPointerDown=${(/** @type {PointerEvent} */ event) => {
        if (event.button !== 0) return;
        canvas.current?.setPointerCapture(event.pointerId);
        setHeld(true);
        drag(event);
      }}
      onPointerMove=${(/** @type {PointerEvent} */ event) => held && drag(event)}
      onPointerUp=${drop}
      onPointerCancel=${drop}
      onKeyDown=${press}
    ></canvas>
    <figcaption class="hint" id="map-hint">
      <span class="sign piece">● the piece</span> <span class="sign other">— variation</span>
      <span class="sign other">◇ leaps</span> <span>⊕ start: drag it or use the arrow keys</span>
    </figcaption>
  </figure>`;
}

const INKS = { sheets: "--edge", piece: "--emerald", other: "--violet", paper: "--paper", ink: "--ink" };

/** Resolve the page's colours for a canvas, which does not support `light-dark`. @param {HTMLElement} element */
function colours(element) {
  const probe = document.createElement("i");
  element.after(probe);
  const found = /** @type {any} */ ({});
  for (const [name, variable] of Object.entries(INKS)) {
    probe.style.color = `var(${variable})`;
    found[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return found;
}
