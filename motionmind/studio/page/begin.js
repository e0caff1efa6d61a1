/** What the page asks for while its other modules are on their way: the project, the gallery and its first pictures. */

import { Api } from "./api.js";
import { movementAt, thumbnail } from "./places.js";

const SEEN = 12; // postures of the gallery that are seen before anybody scrolls

/** Requests to the server, the first of which are under way. */
export const api = new Api();

/** @param {any} gallery */
function expectPictures(gallery) {
  const postures = [gallery.own, ...gallery.corpora.map((/** @type {any} */ corpus) => corpus.postures)].flat();
  for (const { key } of postures.slice(0, SEEN)) new Image().src = thumbnail(key, 0);
  if (postures.length > 0) api.expect(movementAt(postures[0].key));
}

api.expect(`/api/project?window=${api.window}`);
api.expect("/api/gallery").then(expectPictures, () => {}); // who needs it hears why it is not there
