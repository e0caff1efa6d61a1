/** What a window has set from A to B, kept by the server for a reload. */

import { Latest } from "../pose/latest.js";

export class Keeper {
  /** @param {any} desk */
  constructor(desk) {
    this.desk = desk;
    this.api = desk.studio.api;
    this.queue = new Latest(
      () => {},
      () => (this.sent = ""), // the next change sends it
      () => {},
    );
    this.sent = this.#told();
    if (this.api.looks) return; // who only looks sets nothing
    desk.addEventListener("change", () => this.#keep());
    desk.studio.store.addEventListener("back", () => {
      this.sent = ""; // a restarted studio knows nothing
      this.#keep();
    });
    if (this.api.reloaded) this.#restore();
  }

  async #restore() {
    const before = this.sent;
    await this.api.entered;
    const kept = await this.api.get(`/api/desk?window=${this.api.window}`).catch(() => null);
    if (!kept || this.#told() !== before) return; // the user was quicker
    this.desk.restore(kept);
  }

  #keep() {
    const told = this.#told();
    if (told === this.sent) return;
    this.sent = told;
    const body = { window: this.api.window, desk: JSON.parse(told) };
    this.queue.send(() => this.api.post("/api/desk", body, { keepalive: true })); // a reload may come at once
  }

  #told() {
    const { ends, seconds, reaches, spread, job, chosen, shown } = this.desk;
    return JSON.stringify({ a: bare(ends.a), b: bare(ends.b), seconds, reaches, spread, job, chosen, shown });
  }
}

/** @param {import("./desk.js").Place | null} place */
function bare(place) {
  return place && { key: place.key, frame: place.frame, title: place.title.slice(0, 400) };
}
