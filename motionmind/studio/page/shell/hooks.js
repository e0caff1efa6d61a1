/** Hooks for views: what is told by events. */

import { useEffect, useLayoutEffect, useReducer, useRef } from "../vendor/htm-preact-standalone.js";

/**
 * What `pick` takes from a target; the view is made again when that changes.
 * @template T
 * @param {EventTarget} target
 * @param {() => T} pick returns something that is the same as long as nothing has changed
 * @param {string} event
 * @returns {T}
 */
export function useChange(target, pick, event = "change") {
  const [, again] = useReducer((/** @type {number} */ count) => count + 1, 0);
  const shown = useRef(/** @type {T | undefined} */ (undefined));
  const picking = useRef(pick);
  picking.current = pick;
  shown.current = pick();
  useLayoutEffect(() => {
    const changed = () => {
      if (!Object.is(picking.current(), shown.current)) again(0);
    };
    target.addEventListener(event, changed);
    changed(); // while the page was being drawn
    return () => target.removeEventListener(event, changed);
  }, [target, event]);
  return shown.current;
}

/**
 * Let keys act as long as a view is there.
 * @param {{keys: import("./keys.js").Keys}} studio
 * @param {import("./keys.js").Row[]} rows
 */
export function useKeys(studio, rows) {
  const latest = useRef(rows);
  latest.current = rows;
  useEffect(() => {
    const own = rows.map((row, i) => ({ ...row, act: (/** @type {KeyboardEvent} */ event) => latest.current[i].act?.(event) }));
    return studio.keys.add(own);
  }, []);
}
