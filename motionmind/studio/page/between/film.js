/** A film strip: small pictures over the length of an alternative, and a line at its time. */

import { html, useEffect, useRef } from "../vendor/htm-preact-standalone.js";

const MAX_PICTURES = 6; // as many as fit a card on a large screen

/**
 * @param {{job: string, number: number, motion: any, quartet: import("./quartet.js").Quartet | null}} props
 */
export function Film({ job, number, motion, quartet }) {
  const line = useRef(/** @type {any} */ (null));
  useEffect(() => {
    if (!quartet) return undefined;
    const { player } = quartet;
    const update = () => (line.current.style.left = `${(100 * Math.min(player.time / Math.max(motion.end, 1e-9), 1)).toFixed(2)}%`);
    update();
    player.addEventListener("change", update);
    return () => player.removeEventListener("change", update);
  }, [quartet, motion]);
  const seek = (/** @type {MouseEvent} */ event) => {
    if (!quartet) return;
    const { left, width } = /** @type {HTMLElement} */ (event.currentTarget).getBoundingClientRect();
    quartet.player.pause();
    quartet.player.seek(Math.min(Math.max((event.clientX - left) / width, 0), 1) * motion.end);
  };
  const count = Math.min(MAX_PICTURES, motion.length);
  const frames = Array.from({ length: count }, (_, i) => Math.round((i * (motion.length - 1)) / Math.max(count - 1, 1)));
  // The slider of all does the same by keys.
  return html`<div class="film" data-testid="film-${number}" aria-hidden="true" title="Go to this moment" onClick=${seek}>
    ${frames.map((frame) => html`<img key=${frame} src="/api/between/${job}/${number}/${frame}.png" alt="" draggable="false" />`)}
    <span ref=${line} class="film-line"></span>
  </div>`;
}
