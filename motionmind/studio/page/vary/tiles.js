/** The new order as a strip of pictures; each stretch can be looked at, and kept. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";
import { thumbnail } from "../places.js";

const MOST = 400; // stretches with pictures
const QUIET = 120; // milliseconds after which an order is taken to stay: before that no pictures are asked for
/** @type {Set<string>} */
const loaded = new Set(); // addresses of pictures that have come
const SEAMS = /** @type {Record<string, [string, string]>} */ ({
  smooth: ["–", "follows as it is"],
  abrupt: ["!", "is abrupt, and will be smoothed"],
  waiting: ["…", "is not judged yet"],
  inserted: ["+", "has movement inserted"],
  discarded: ["×", "its insertion is left out"],
  "none found": ["!", "is abrupt; nothing was found to smooth it"],
});

/**
 * @param {{piece: any, kept: string[], locked: string[], onKeep: (id: string) => void,
 *   onPlay: (block: any) => void}} props
 */
export function Tiles({ piece, kept, locked, onKeep, onPlay }) {
  const [settled, setSettled] = useState(/** @type {any} */ (null));
  const { blocks, seams } = piece;
  useEffect(() => {
    const waiting = setTimeout(() => setSettled(piece), QUIET);
    return () => clearTimeout(waiting);
  }, [piece]);
  const picture = (/** @type {any} */ block) => {
    const address = thumbnail(block.key, block.first, 64);
    return settled === piece || loaded.has(address) ? address : undefined;
  };
  return html`<ol class="tiles" data-testid="order" aria-label="The new order">
    ${blocks.slice(0, MOST).map((/** @type {any} */ block, /** @type {number} */ i) => {
      const keeps = kept.includes(block.id);
      const fixed = locked.includes(block.id);
      const [sign, words] = i ? SEAMS[seams[i - 1].state] ?? ["…", ""] : ["", ""];
      const inserted = i && seams[i - 1].state === "inserted" ? ` ${seams[i - 1].seconds.toFixed(1)} s` : "";
      const label = `${i + 1}: ${block.title}, ${block.seconds.toFixed(1)} seconds`;
      return html`<li key=${block.id} class=${keeps ? "kept" : ""} data-testid="tile-${i + 1}">
        ${i > 0 && html`<span class="seam ${seams[i - 1].state.replace(" ", "-")}" title=${words}>${sign}${inserted}</span>`}
        <button class="picture" title="${block.title}: look at it" aria-label="Look at ${label}" onClick=${() => onPlay(block)}>
          <img loading="lazy" alt="" width="56" height="64" src=${picture(block)}
            onLoad=${(/** @type {any} */ event) => loaded.add(event.target.getAttribute("src"))} />
        </button>
        <button
          class="keep"
          aria-pressed=${keeps}
          disabled=${fixed}
          title=${fixed ? "kept: its insertion is locked on the time line" : keeps ? "let it go" : "keep it where it is"}
          aria-label="${keeps ? "Kept" : "Keep"} ${label}"
          onClick=${() => onKeep(block.id)}
        >
          ${keeps ? "kept" : "keep"}
        </button>
      </li>`;
    })}
    ${blocks.length > MOST && html`<li class="hint">and ${blocks.length - MOST} more</li>`}
  </ol>`;
}
