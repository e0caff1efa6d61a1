/** A queue of one: while a request is under way, only the latest new one waits. */

export class Latest {
  /**
   * @param {(answer: any) => void} taken called with each answer
   * @param {(error: unknown) => void} failed
   * @param {() => void} rests called when no request is left
   */
  constructor(taken, failed, rests) {
    this.taken = taken;
    this.failed = failed;
    this.rests = rests;
    /** @type {(() => Promise<any>) | null} */
    this.next = null;
    this.busy = false;
    /** @type {(() => void)[]} */
    this.waiting = [];
  }

  /** @param {() => Promise<any>} ask */
  send(ask) {
    this.next = ask;
    if (!this.busy) this.#run();
  }

  /** Wait until no request is left. @returns {Promise<void>} */
  settled() {
    return this.busy ? new Promise((resolve) => this.waiting.push(resolve)) : Promise.resolve();
  }

  async #run() {
    this.busy = true;
    while (this.next) {
      const ask = this.next;
      this.next = null;
      try {
        this.taken(await ask());
      } catch (error) {
        this.next = null;
        this.failed(error);
      }
    }
    this.busy = false;
    for (const resolve of this.waiting.splice(0)) resolve();
    this.rests();
  }
}
