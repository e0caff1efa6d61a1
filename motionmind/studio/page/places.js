/** Where on the server a movement and its pictures are, by its key. */

export function movementAt(/** @type {string} */ key) {
  return `/api/movements/${path(key)}`;
}

/** Where a picture of a frame is, so many pixels high; it stands on any paper. */
export function thumbnail(/** @type {string} */ key, /** @type {number} */ frame, height = 96) {
  return `/api/thumbnails/${path(key)}/${frame}.png?height=${height}`;
}

/** @param {string} key */
function path(key) {
  return key.split("/").map(encodeURIComponent).join("/");
}
