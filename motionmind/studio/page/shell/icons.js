/** Icons, drawn for the studio: lines on a 20 by 20 grid. */

import { html } from "../vendor/htm-preact-standalone.js";

const PATHS = /** @type {Record<string, string>} */ ({
  brand: "M10 4.2a1.7 1.7 0 1 0 0-.1M3 7.5l5.5 1.2v4L5 18M17 5.5 11.5 8.7v4L16 16",
  between: "M5 4.6a1.4 1.4 0 1 0 0-.1M5 7v5l-2 5M5 12l2 5M15 4.6a1.4 1.4 0 1 0 0-.1M15 7v5l-2 5M15 12l2 5M8.5 9.5h3m-1-1.5 1.5 1.5L10.500 11",
  vary: "M3 12c0-9 7-9 7-2s7 7 7-2M3 12c0 6 7 6 7-2s7-8 7-2",
  pose: "M10 4.500a1.700 1.700 0 1 0 0-.1M10 7v5M10 12l-4 5.500M10 12l4 5.500M10 8.500 4 6M10 8.500l6 1.500M3.200 6a.8.8 0 1 0 0-.1M16.200 10a.8.8 0 1 0 0-.1",
  dancers: "M4.500 5.600a1.300 1.300 0 1 0 0-.1M4.500 8v4L3 17M4.500 12 6 17M10 3.600a1.300 1.300 0 1 0 0-.1M10 6v4.500L8.500 16M10 10.500l1.500 5.500M15.500 5.600a1.300 1.300 0 1 0 0-.1M15.500 8v4L14 17M15.500 12l1.500 5",
  movement: "M3 13.500V16a1 1 0 0 0 1 1h12a1 1 0 0 0 1-1v-2.500M10 3v10M6.500 9.500 10 13l3.500-3.500",
  take: "M3 13.500V16a1 1 0 0 0 1 1h12a1 1 0 0 0 1-1v-2.500M10 13V3M6.500 6.500 10 3l3.500 3.500",
  undo: "M7 4 3.500 7.500 7 11M4 7.500h7a4.500 4.500 0 0 1 0 9H8",
  redo: "m13 4 3.500 3.500L13 11M16 7.500H9a4.500 4.500 0 0 0 0 9h3",
  dark: "M16.500 11.500A7 7 0 0 1 8.500 3.500a7 7 0 1 0 8 8z",
  keys: "M3 6a1 1 0 0 1 1-1h12a1 1 0 0 1 1 1v8a1 1 0 0 1-1 1H4a1 1 0 0 1-1-1zM6 8h.01M9 8h.01M12 8h.01M14.500 8h.01M6.500 12h7",
  video: "M3 5.500a1 1 0 0 1 1-1h8a1 1 0 0 1 1 1v9a1 1 0 0 1-1 1H4a1 1 0 0 1-1-1zM13 9l4-2.500v7L13 11",
  share: "M6.500 10a2 2 0 1 0-4 0 2 2 0 0 0 4 0zM17.500 4.500a2 2 0 1 0-4 0 2 2 0 0 0 4 0zM17.500 15.500a2 2 0 1 0-4 0 2 2 0 0 0 4 0zM6.300 9.100l7.400-3.700M6.300 10.900l7.400 3.700",
  close: "m5 5 10 10M15 5 5 15",
  swap: "M4 7h12l-3-3M16 13H4l3 3",
  back: "M12 4 6 10l6 6",
  first: "M5 4v12M15 4l-7 6 7 6z",
  last: "M15 4v12M5 4l7 6-7 6z",
  loop: "M4 10a5 5 0 0 1 5-5h6m-2.500-2.500L15 5l-2.500 2.500M16 10a5 5 0 0 1-5 5H5m2.500 2.500L5 15l2.500-2.500",
  check: "m4 10.500 4 4 8-9",
  warning: "M10 3 2.500 16.500h15zM10 8v4M10 14.500h.01",
  search: "M9 4a5 5 0 1 0 0 10A5 5 0 0 0 9 4zM13 13l4 4",
});
const FULL = /** @type {Record<string, string>} */ ({ play: "M6 3.500v13l10-6.500z", pause: "M5 4h3.500v12H5zM11.500 4H15v12h-3.500z" });

/**
 * An icon; text beside it, or the button's label, names it.
 * @param {string} name
 */
export function icon(name) {
  const full = FULL[name];
  return html`<svg viewBox="0 0 20 20" aria-hidden="true"><path class=${full ? "full" : ""} d=${full ?? PATHS[name]} /></svg>`;
}
