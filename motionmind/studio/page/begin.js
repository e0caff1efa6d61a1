/** Requests that start while the other modules load: the project, the gallery and its first pictures. */

import { Api } from "./api.js";
import { knowPostures, movementAt, thumbnail } from "./places.js";

const VISIBLE_PICTURES = 12; // in the gallery, without scrolling
const FIRST_PICTURES = 3; // the 3D view waits for these: without a GPU it takes longest

/** The server's API; the first requests are under way. */
export const api = new Api();

// The URL of a restarted studio differs only in its token, so opening it here does not reload the page.
addEventListener("hashchange", () => /token|look/.test(location.hash) && location.reload());

/** @param {[any, any]} answers the gallery and the project */
function prefetchPictures([gallery, project]) {
  knowPostures(project.postures);
  const postures = [gallery.own, ...gallery.corpora.map((/** @type {any} */ corpus) => corpus.postures)].flat();
  const pictures = postures.slice(0, VISIBLE_PICTURES).map(({ key }) => Object.assign(new Image(), { src: thumbnail(key, 0) }));
  if (postures.length > 0) api.prefetch(movementAt(postures[0].key));
  return Promise.allSettled(pictures.slice(0, FIRST_PICTURES).map((picture) => picture.decode()));
}

/** The gallery and its first pictures. */
function prefetchGallery() {
  return Promise.all([api.prefetch("/api/gallery"), project]).then(prefetchPictures, () => {}); // later requests report the error
}

const project = api.prefetch(`/api/project?window=${api.window}`);
/** @type {Promise<unknown>} settles when the gallery's first pictures have loaded or failed */
export const pictured = api.looks ? Promise.resolve() : prefetchGallery();
project.then(
  ({ access }) => access === "look" && !api.looks && api.onlyLook(),
  () => {},
);
