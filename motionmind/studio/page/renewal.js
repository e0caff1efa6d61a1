/**
 * Let this page in again after the studio restarted, by a key that neither side sends: first the studio proves that it has the
 * key, then the page. The key stays in memory, where no other program at the same address finds it.
 */

const HASH = { name: "HMAC", hash: "SHA-256" };

export class Renewal {
  /** @type {CryptoKey | null} */
  #key = null;
  /** @type {Promise<boolean> | null} the renewal under way */
  #doing = null;

  /** @param {import("./api.js").Api} api */
  constructor(api) {
    this.api = api;
  }

  /** Fetch the key, which a studio that other computers reach does not have. The cookie of the look-only link outlasts it. */
  async learn() {
    if (this.api.looks) return;
    const { key } = await this.api.get("/api/renewal");
    this.#key = key ? await crypto.subtle.importKey("raw", new TextEncoder().encode(key), HASH, false, ["sign"]) : null;
  }

  /** Get a new cookie; return whether the studio gave one. @returns {Promise<boolean>} */
  renew() {
    this.#doing ??= this.#renew()
      .catch(() => false)
      .finally(() => (this.#doing = null));
    return this.#doing;
  }

  async #renew() {
    if (!this.#key) return false;
    const number = random(32);
    const studio = await this.api.post("/api/challenge", { number });
    if (studio.proof !== (await this.#proof("studio", number, studio.number))) return false;
    await this.api.post("/api/renew", { number: studio.number, proof: await this.#proof("page", number, studio.number) });
    return true;
  }

  /** @param {"studio" | "page"} side @param {string} number of the page @param {string} own of the studio */
  async #proof(side, number, own) {
    const text = new TextEncoder().encode(`${side} ${location.origin} ${number} ${own}`);
    return hex(new Uint8Array(await crypto.subtle.sign("HMAC", /** @type {CryptoKey} */ (this.#key), text)));
  }
}

/** Random digits; `crypto.randomUUID` is missing on pages of other computers. @param {number} bytes */
export function random(bytes) {
  return hex(crypto.getRandomValues(new Uint8Array(bytes)));
}

/** @param {Uint8Array} bytes */
function hex(bytes) {
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
