/** Movements by key, for the player, with a cache. */

import { Body } from "motionmind/body";
import { Motion } from "motionmind/motion";
import { movementAt, stable } from "./places.js";

const MAX_CACHED = 48; // movements, the most recently used
/** @type {Map<string, Promise<any>>} */
const cache = new Map();
/** @type {Map<string, {body: Body, colours: object}>} */
const bodies = new Map(); // shared by many movements: meshes take a while to build

/**
 * Fetch a movement: a Motion of the player, with its `key`, its `body` and its `colours`.
 * @param {{get: (path: string) => Promise<any>}} api
 * @param {string} key
 * @returns {Promise<any>}
 */
export function movement(api, key) {
  const now = stable(key); // a saved posture may have been replaced since
  const known = cache.get(now);
  cache.delete(now);
  const found = known ?? api.get(movementAt(key)).then((/** @type {object} */ data) => playable(data, key));
  if (!known) found.catch(() => cache.delete(now));
  cache.set(now, found);
  if (cache.size > MAX_CACHED) cache.delete(cache.keys().next().value ?? "");
  return found;
}

/**
 * Convert the server's data of a movement to a Motion of the player.
 * @param {any} data
 * @param {string} key
 */
export function playable(data, key = "") {
  const about = JSON.stringify([data.skeleton, data.body]);
  if (!bodies.has(about)) bodies.set(about, { body: new Body(data.skeleton, data.body), colours: data.colours });
  return Object.assign(new Motion(data), { key }, bodies.get(about));
}
