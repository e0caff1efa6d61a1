/** Files that somebody brings and the corpora that there are, as the page knows them. It draws nothing. */

const AT_ONCE = 2; // files that are sent
const LARGEST = 64 * 2 ** 20; // bytes; the server has the same limit
const READABLE = [".bvh", ".glb", ".vrm", ".vrma", ".amc", ".asf", ".npz", ".json", ".score"];
/** @type {Record<string, string>} */
const REFUSED = {
  ".fbx": "FBX is not read: open it in Blender (File, Import, FBX) and export glTF (.glb), or BVH",
  ".c3d": "C3D holds markers on the skin, not joints: solve a skeleton from them, and export that as BVH",
  ".gltf": "a .gltf takes in other files: export it as one .glb",
};
const NAME = /^[\p{L}\p{N}_][\p{L}\p{N}_.-]{0,63}$/u;

export const ACCEPT = READABLE.join(",");

/**
 * @typedef {{name: string, frames: number, seconds: number, fps: number | null, posed_first: boolean}} Clip
 * @typedef {{joint: string, times: number, seconds: number, degrees: number, clip: number}} Fault
 * @typedef {{clips: Clip[], joints: number, rig: string, filled: string[], height: number, unit: string,
 *   is_guessed: boolean, doubt: string, faults: Fault[], notes: string[], people: boolean}} Facts
 * @typedef {{unit: string | null, fps: number | null, asf: string | null, skip: number | null}} Choices
 * @typedef {{id: string, name: string, size: number, kind: string, choices: Choices, facts: Facts | null, error: string,
 *   skips?: number[]}} Upload
 * @typedef {{number: number, name: string, error: string}} Coming
 * @typedef {{name: string, title: string, own: boolean, error: string, clips?: number, rate?: number | null}} Corpus
 */

/** Fires "change" whenever something of it has changed. */
export class Imports extends EventTarget {
  /** @param {import("../api.js").Api} api */
  constructor(api) {
    super();
    this.api = api;
    /** @type {Upload[]} */
    this.files = [];
    /** @type {Coming[]} files on their way, and those that were refused */
    this.coming = [];
    /** @type {Corpus[]} */
    this.corpora = [];
    /** @type {Set<string>} ids of files that are not to be learned from */
    this.left = new Set();
    /** @type {Set<string>} ids of files that are read again */
    this.reading = new Set();
    this.version = 0;
    this.count = 0;
    /** @type {Promise<void>[]} */
    this.lanes = Array.from({ length: AT_ONCE }, () => Promise.resolve());
  }

  /** See what is there. */
  async refresh() {
    [this.files, this.corpora] = await Promise.all([this.api.get("/api/imports"), this.api.get("/api/corpora")]);
    this.#changed();
  }

  /** Bring files; skeletons go first, for other files need them. @param {Iterable<File>} files */
  bring(files) {
    const sorted = [...files].sort((one, other) => Number(suffix(other.name) === ".asf") - Number(suffix(one.name) === ".asf"));
    const jobs = [];
    for (const file of sorted) {
      const coming = { number: ++this.count, name: file.name, error: refused(file) };
      this.coming = [...this.coming, coming];
      if (coming.error) continue;
      const lane = suffix(file.name) === ".asf" || suffix(file.name) === ".amc" ? 0 : this.count % AT_ONCE;
      this.lanes[lane] = this.lanes[lane].then(() => this.#send(file, coming));
      jobs.push(this.lanes[lane]);
    }
    this.#changed();
    return Promise.all(jobs);
  }

  /** @param {File} file @param {Coming} coming */
  async #send(file, coming) {
    try {
      const upload = await this.api.upload("/api/imports", file, file.name);
      this.files = [...this.files, upload];
      this.coming = this.coming.filter((other) => other !== coming);
      if (upload.kind === "asf") await this.#dress(upload.id);
      if (upload.kind === "score") await this.#complete(upload);
    } catch (error) {
      this.coming = this.coming.map((other) => (other === coming ? { ...coming, error: /** @type {Error} */ (error).message } : other));
    }
    this.#changed();
  }

  /** Read the files again that lacked a skeleton. @param {string} asf */
  async #dress(asf) {
    for (const file of this.files) if (file.kind === "amc" && !file.facts) await this.choose(file, { asf });
  }

  /** Read the scores again that another one lacked. @param {Upload} score */
  async #complete(score) {
    for (const file of this.files) if (file.error.includes(`takes in ${score.name}:`)) await this.choose(file, {});
  }

  /** Read a file again with other answers to what it leaves open. @param {Upload} file @param {Partial<Choices>} change */
  async choose(file, change) {
    this.reading.add(file.id);
    this.#changed();
    try {
      this.#put(await this.api.post(`/api/imports/${file.id}`, { ...file.choices, ...change }));
    } finally {
      this.reading.delete(file.id);
      this.#changed();
    }
  }

  /** @param {Upload} file */
  async forget(file) {
    await this.api.delete(`/api/imports/${file.id}`);
    this.files = this.files.filter((other) => other.id !== file.id);
    this.#changed();
  }

  /** No longer show a file that was refused. @param {Coming} coming */
  dismiss(coming) {
    this.coming = this.coming.filter((other) => other !== coming);
    this.#changed();
  }

  /** Keep a clip of a file in the project. @param {Upload} file @param {number} clip @returns {Promise<{key: string, frames: number}>} */
  keep(file, clip) {
    return this.api.post(`/api/imports/${file.id}/${clip}/keep`);
  }

  /** What the player shows of a clip. @param {Upload} file @param {number} clip */
  movement(file, clip) {
    return this.api.get(`/api/imports/${file.id}/${clip}/movement`);
  }

  /** Learn from a file or not. @param {string} id @param {boolean} wanted */
  want(id, wanted) {
    if (wanted) this.left.delete(id);
    else this.left.add(id);
    this.#changed();
  }

  /** The clips that are to be learned from. */
  get parts() {
    return this.files
      .filter((file) => file.facts && !this.left.has(file.id))
      .flatMap((file) => (file.facts?.clips ?? []).map((_, clip) => ({ upload: file.id, clip })));
  }

  /**
   * Learn a corpus; returns the job's id.
   * @param {{name: string, title: string, mix: {name: string, weight: number}[], mirror: boolean}} wish
   */
  async learn(wish) {
    return (await this.api.post("/api/corpora", { ...wish, parts: this.parts })).job;
  }

  /** Why a corpus cannot have a name; "" if it can. @param {string} name */
  refusal(name) {
    if (!NAME.test(name)) return "a name is of letters, digits, -, _ and ., without spaces, 64 at most";
    const other = this.corpora.find((corpus) => corpus.name === name);
    if (!other) return "";
    return `there is a corpus ${name} already: choose another name${other.own ? ", or delete that one first" : ""}`;
  }

  /** @param {string} name */
  sheet(name) {
    return this.api.get(`/api/corpora/${encodeURIComponent(name)}`);
  }

  /** @param {string} name */
  async delete(name) {
    await this.api.delete(`/api/corpora/${encodeURIComponent(name)}`);
    await this.refresh();
  }

  /** @param {Upload} upload */
  #put(upload) {
    this.files = this.files.map((other) => (other.id === upload.id ? upload : other));
    this.#changed();
  }

  #changed() {
    this.version += 1;
    this.dispatchEvent(new Event("change"));
  }
}

/** @param {string} name */
function suffix(name) {
  return name.includes(".") ? name.slice(name.lastIndexOf(".")).toLowerCase() : "";
}

/** Why a file is not worth sending; "" if it is. @param {File} file */
function refused(file) {
  const end = suffix(file.name);
  if (REFUSED[end]) return `${file.name}: ${REFUSED[end]}`;
  if (!READABLE.includes(end)) return `${file.name}: files that can be read end in ${READABLE.join(", ")}`;
  if (file.size > LARGEST) return `${file.name}: is larger than ${LARGEST / 2 ** 20} MB; bring a part of it`;
  return "";
}
