/** Hooks that connect views to events and keys. */

import { useEffect, useLayoutEffect, useReducer, useRef } from "../vendor/htm-preact-standalone.js";

/**
 * Return what `pick` takes from a target; render again when it changes.
 * @template T
 * @param {EventTarget} target
 * @param {() => T} pick must return an identical value as long as nothing has changed
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
    changed(); // it may have changed during rendering
    return () => target.removeEventListener(event, changed);
  }, [target, event]);
  return shown.current;
}

/**
 * Return a function that makes one object for a studio, which outlives the panels that use it.
 * @template T
 * @param {(studio: any) => T} make
 * @returns {(studio: any) => T}
 */
export function perStudio(make) {
  /** @type {WeakMap<object, T>} */
  const made = new WeakMap();
  return (studio) => {
    const known = made.get(studio) ?? make(studio);
    made.set(studio, known);
    return known;
  };
}

/**
 * Register keys while a view is mounted.
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
