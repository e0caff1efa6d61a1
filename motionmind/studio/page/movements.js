/** Movement by its key, as the player shows it; what was fetched once is kept as long as there is room. */

import { Body } from "motionmind/body";
import { Motion } from "motionmind/motion";
import { movementAt, stable } from "./places.js";

const MOST = 48; // movements that are kept, the latest used
/** @type {Map<string, Promise<any>>} */
const kept = new Map();
/** @type {Map<string, {body: Body, colours: object}>} */
const bodies = new Map(); // bodies are many movements', and what draws them takes a while to make

/**
 * Fetch a movement: a Motion of the player, with its `key`, its `body` and its `colours`.
 * @param {{get: (path: string) => Promise<any>}} api
 * @param {string} key
 * @returns {Promise<any>}
 */
export function movement(api, key) {
  const now = stable(key); // one's own posture may have been saved again since
  const known = kept.get(now);
  kept.delete(now);
  const found = known ?? api.get(movementAt(key)).then((/** @type {object} */ data) => playable(data, key));
  if (!known) found.catch(() => kept.delete(now));
  kept.set(now, found);
  if (kept.size > MOST) kept.delete(kept.keys().next().value ?? "");
  return found;
}

/**
 * Make what the server tells of a movement one that plays.
 * @param {any} data
 * @param {string} key
 */
export function playable(data, key = "") {
  const about = JSON.stringify([data.skeleton, data.body]);
  if (!bodies.has(about)) bodies.set(about, { body: new Body(data.skeleton, data.body), colours: data.colours });
  return Object.assign(new Motion(data), { key }, bodies.get(about));
}
