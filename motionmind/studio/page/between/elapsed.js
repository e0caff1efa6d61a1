/** Seconds that a search has taken. */

import { html, useEffect, useState } from "../vendor/htm-preact-standalone.js";

/** @param {{since: number}} props the start, milliseconds as of `performance.now` */
export function Elapsed({ since }) {
  const [seconds, set] = useState(0);
  useEffect(() => {
    const count = () => set(Math.floor((performance.now() - since) / 1000));
    count();
    const timer = setInterval(count, 250);
    return () => clearInterval(timer);
  }, [since]);
  return html`<span class="hint numbers" data-testid="elapsed" aria-hidden="true">${seconds} s</span>`;
}
