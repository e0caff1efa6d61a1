/** The new order as a strip of pictures; play or keep each stretch. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";
import { thumbnail } from "../places.js";

const MAX_TILES = 400;
const SETTLE_MS = 120; // load pictures only of an order that lasts this long
/** @type {Set<string>} */
const loaded = new Set(); // URLs of loaded pictures
const SEAMS = /** @type {Record<string, [string, string]>} */ ({
  smooth: ["–", "smooth"],
  abrupt: ["!", "abrupt: will be smoothed"],
  waiting: ["…", "not checked yet"],
  inserted: ["+", "movement inserted"],
  discarded: ["×", "insertion discarded"],
  "none found": ["!", "abrupt: no insertion found"],
});

/**
 * @param {{piece: any, kept: string[], locked: string[], onKeep: (id: string) => void,
 *   onPlay: (block: any) => void}} props
 */
export function Tiles({ piece, kept, locked, onKeep, onPlay }) {
  const [settled, setSettled] = useState(/** @type {any} */ (null));
  const { blocks, seams } = piece;
  useEffect(() => {
    const waiting = setTimeout(() => setSettled(piece), SETTLE_MS);
    return () => clearTimeout(waiting);
  }, [piece]);
  const picture = (/** @type {any} */ block) => {
    const address = thumbnail(block.key, block.first, 64);
    return settled === piece || loaded.has(address) ? address : undefined;
  };
  return html`<ol class="tiles" data-testid="order" aria-label="The new order">
    ${blocks.slice(0, MAX_TILES).map((/** @type {any} */ block, /** @type {number} */ i) => {
      const keeps = kept.includes(block.id);
      const fixed = locked.includes(block.id);
      const before = seams.find(({ left, right }) => right === block.id && left !== right);
      const [sign, words] = before ? SEAMS[before.state] ?? ["…", ""] : ["", ""];
      const inserted = before?.state === "inserted" ? ` ${before.seconds.toFixed(1)} s` : "";
      const label = `${i + 1}: ${block.title}, ${block.seconds.toFixed(1)} seconds`;
      return html`<li key=${block.id} class=${keeps ? "kept" : ""} data-testid="tile-${i + 1}">
        ${before && html`<span class="seam ${before.state.replace(" ", "-")}" title=${words}>${sign}${inserted}</span>`}
        <button class="picture" title="Play ${block.title}" aria-label="Play ${label}" onClick=${() => onPlay(block)}>
          <img loading="lazy" alt="" width="56" height="64" src=${picture(block)}
            onLoad=${(/** @type {any} */ event) => loaded.add(event.target.getAttribute("src"))} />
        </button>
        <button
          class="keep"
          aria-pressed=${keeps}
          disabled=${fixed}
          title=${fixed ? "kept: its insertion is locked on the time line" : keeps ? "release it" : "keep it in place"}
          aria-label="${keeps ? "Kept" : "Keep"} ${label}"
          onClick=${() => onKeep(block.id)}
        >
          ${keeps ? "kept" : "keep"}
        </button>
      </li>`;
    })}
    ${blocks.length > MAX_TILES && html`<li class="hint">and ${blocks.length - MAX_TILES} more</li>`}
  </ol>`;
}
