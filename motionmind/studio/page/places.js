/** URLs of a movement and its thumbnails, by its key. */

/** @type {Map<string, string>} keys of the movements that hold the saved postures, by the postures' keys */
let own = new Map();

/** Update the saved postures: a replaced posture has another movement. @param {{name: string, key: string}[]} postures */
export function knowPostures(postures) {
  own = new Map(postures.map(({ name, key }) => [`own/${name}`, key]));
}

/** The key of the movement that a key stands for now. @param {string} key */
export function stable(key) {
  return own.get(key) ?? key;
}

export function movementAt(/** @type {string} */ key) {
  return `/api/movements/${path(key)}`;
}

/** The URL of a thumbnail of a frame, with its height in pixels; the browser caches it. */
export function thumbnail(/** @type {string} */ key, /** @type {number} */ frame, height = 96) {
  return `/api/thumbnails/${path(stable(key))}/${frame}.png?height=${height}`;
}

/** @param {string} key */
function path(key) {
  return key.split("/").map(encodeURIComponent).join("/");
}
