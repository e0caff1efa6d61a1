/** What the page asks for while its other modules are on their way: the project, the gallery and its first pictures. */

import { Api } from "./api.js";
import { knowPostures, movementAt, thumbnail } from "./places.js";

const SEEN = 12; // postures of the gallery that are seen before anybody scrolls
const FIRST = 3; // of them, for which the body in 3D waits: where there is no GPU it takes longer than all else

/** Requests to the server, the first of which are under way. */
export const api = new Api();

// The address of a studio that was started again, opened where its page is: nothing but the key in it is another.
addEventListener("hashchange", () => location.hash.includes("token") && location.reload());

/** @param {[any, any]} answers the gallery and the project */
function expectPictures([gallery, project]) {
  knowPostures(project.postures);
  const postures = [gallery.own, ...gallery.corpora.map((/** @type {any} */ corpus) => corpus.postures)].flat();
  const pictures = postures.slice(0, SEEN).map(({ key }) => Object.assign(new Image(), { src: thumbnail(key, 0) }));
  if (postures.length > 0) api.expect(movementAt(postures[0].key));
  return Promise.allSettled(pictures.slice(0, FIRST).map((picture) => picture.decode()));
}

const project = api.expect(`/api/project?window=${api.window}`);
/** @type {Promise<unknown>} over when the gallery's first pictures have come, or will not */
export const pictured = Promise.all([api.expect("/api/gallery"), project]).then(expectPictures, () => {}); // who needs it hears why it is not there
