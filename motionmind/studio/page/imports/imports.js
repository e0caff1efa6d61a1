/** Uploaded files and the corpora, as the page knows them. It draws nothing. */

const PARALLEL_UPLOADS = 2;
const MAX_BYTES = 64 * 2 ** 20; // of a file, as on the server
const READABLE = [".bvh", ".glb", ".vrm", ".vrma", ".amc", ".asf", ".npz", ".json", ".score"];
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

/** Fires "change" on any change. */
export class Imports extends EventTarget {
  /** @param {import("../api.js").Api} api */
  constructor(api) {
    super();
    this.api = api;
    /** @type {Upload[]} */
    this.files = [];
    /** @type {Coming[]} files being uploaded, and refused ones */
    this.coming = [];
    /** @type {Corpus[]} */
    this.corpora = [];
    /** @type {Set<string>} ids of files to leave out of learning */
    this.left = new Set();
    /** @type {Set<string>} ids of files being read again */
    this.reading = new Set();
    this.version = 0;
    this.count = 0;
    /** @type {Promise<void>[]} */
    this.lanes = Array.from({ length: PARALLEL_UPLOADS }, () => Promise.resolve());
  }

  /** Fetch the uploads and the corpora. */
  async refresh() {
    [this.files, this.corpora] = await Promise.all([this.api.get("/api/imports"), this.api.get("/api/corpora")]);
    this.#changed();
  }

  /** Upload files; skeletons go first, because other files need them. @param {Iterable<File>} files */
  add(files) {
    const sorted = [...files].sort((one, other) => Number(suffix(other.name) === ".asf") - Number(suffix(one.name) === ".asf"));
    const jobs = [];
    for (const file of sorted) {
      const coming = { number: ++this.count, name: file.name, error: tooLarge(file) };
      this.coming = [...this.coming, coming];
      if (coming.error) continue;
      const lane = suffix(file.name) === ".asf" || suffix(file.name) === ".amc" ? 0 : this.count % PARALLEL_UPLOADS;
      this.lanes[lane] = this.lanes[lane].then(() => this.#send(file, coming));
      jobs.push(this.lanes[lane]);
    }
    this.#changed();
    return Promise.all(jobs);
  }

  /** @param {File} file @param {Coming} coming */
  async #send(file, coming) {
    try {
      const upload = await this.api.upload("/api/imports", readable(file) ? file : new Blob(), file.name);
      this.files = [...this.files, upload];
      this.coming = this.coming.filter((other) => other !== coming);
      if (upload.kind === "asf") await this.#readWithSkeleton(upload.id);
      if (upload.kind === "score") await this.#readWithScore(upload);
    } catch (error) {
      this.coming = this.coming.map((other) => (other === coming ? { ...coming, error: /** @type {Error} */ (error).message } : other));
    }
    this.#changed();
  }

  /** Read again the files that lacked a skeleton. @param {string} asf */
  async #readWithSkeleton(asf) {
    for (const file of this.files) if (file.kind === "amc" && !file.facts) await this.choose(file, { asf });
  }

  /** Read again the scores that lacked an included score. @param {Upload} score */
  async #readWithScore(score) {
    for (const file of this.files) if (file.error.includes(`includes ${score.name}:`)) await this.choose(file, {});
  }

  /** Read a file again with other choices. @param {Upload} file @param {Partial<Choices>} change */
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

  /** Remove a refused file from the list. @param {Coming} coming */
  dismiss(coming) {
    this.coming = this.coming.filter((other) => other !== coming);
    this.#changed();
  }

  /** Store a clip of a file in the project. @param {Upload} file @param {number} clip @returns {Promise<{key: string, frames: number}>} */
  keep(file, clip) {
    return this.api.post(`/api/imports/${file.id}/${clip}/keep`);
  }

  /** Fetch a clip for the player. @param {Upload} file @param {number} clip */
  movement(file, clip) {
    return this.api.get(`/api/imports/${file.id}/${clip}/movement`);
  }

  /** Choose whether to learn from a file. @param {string} id @param {boolean} wanted */
  want(id, wanted) {
    if (wanted) this.left.delete(id);
    else this.left.add(id);
    this.#changed();
  }

  /** The clips to learn from. */
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

  /** Why a name is invalid for a corpus; "" if it is valid. @param {string} name */
  refusal(name) {
    if (!NAME.test(name)) return "a name has up to 64 letters, digits, -, _ and ., without spaces";
    const other = this.corpora.find((corpus) => corpus.name === name);
    if (!other) return "";
    return `corpus ${name} already exists: choose another name${other.own ? " or delete it first" : ""}`;
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

/** Whether the server may read a file; it says what to do with others. @param {File} file */
function readable(file) {
  return READABLE.includes(suffix(file.name));
}

/** Why a file cannot be uploaded; "" if it can. @param {File} file */
function tooLarge(file) {
  const large = readable(file) && file.size > MAX_BYTES;
  return large ? `${file.name}: larger than ${MAX_BYTES / 2 ** 20} MB; upload a part of it` : "";
}
