/** What the page asks for while its other modules are on their way: the project, the gallery and its first pictures. */

import { Api } from "./api.js";

/** Requests to the server, the first of which are under way. */
export const api = new Api();

api.begin(`/api/project?window=${api.window}`, "/api/gallery");
