/** Where on the server a movement and its pictures are, by its key. */

/** @type {Map<string, string>} the movements that one's own postures are now, by their keys */
let own = new Map();

/** Know what is saved: a posture that is replaced is another movement. @param {{name: string, key: string}[]} postures */
export function knowPostures(postures) {
  own = new Map(postures.map(({ name, key }) => [`own/${name}`, key]));
}

/** The key of what a movement is now, which no other has. @param {string} key */
export function stable(key) {
  return own.get(key) ?? key;
}

export function movementAt(/** @type {string} */ key) {
  return `/api/movements/${path(key)}`;
}

/** Where a picture of a frame is, so many pixels high; it stands on any paper, and a browser keeps it. */
export function thumbnail(/** @type {string} */ key, /** @type {number} */ frame, height = 96) {
  return `/api/thumbnails/${path(stable(key))}/${frame}.png?height=${height}`;
}

/** @param {string} key */
function path(key) {
  return key.split("/").map(encodeURIComponent).join("/");
}
