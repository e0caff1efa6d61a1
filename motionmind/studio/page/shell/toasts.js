/** Messages at the edge of the page, one line each. */

import { html } from "../vendor/htm-preact-standalone.js";
import { useChange } from "./hooks.js";
import { icon } from "./icons.js";

const NOTE_MS = 8000; // an error stays until its cause or the user ends it, or three more arrive
const MAX_SHOWN = 3;

/** @typedef {{words: string, kind: "error" | "note", number: number}} Toast */

export class Toasts extends EventTarget {
  constructor() {
    super();
    /** @type {Toast[]} */
    this.shown = [];
    this.count = 0;
  }

  /**
   * Show a line; a repeat replaces it.
   * @param {string} words
   * @param {{kind?: "error" | "note"}} how
   */
  say(words, { kind = "note" } = {}) {
    const toast = { words, kind, number: ++this.count };
    this.#set([...this.shown.filter((other) => other.words !== words), toast].slice(-MAX_SHOWN));
    if (kind === "note") setTimeout(() => this.close(toast), NOTE_MS);
  }

  /** @param {Toast} toast */
  close(toast) {
    this.#set(this.shown.filter((other) => other !== toast));
  }

  /** Close the line with these words, whose cause is gone. @param {string} words */
  withdraw(words) {
    if (this.shown.some((toast) => toast.words === words)) this.#set(this.shown.filter((toast) => toast.words !== words));
  }

  /** @param {Toast[]} shown */
  #set(shown) {
    this.shown = shown;
    this.dispatchEvent(new Event("change"));
  }
}

/** @param {{toasts: Toasts}} props */
export function Shown({ toasts }) {
  const shown = useChange(toasts, () => toasts.shown);
  return html`<div class="toasts" role="log" aria-live="polite" aria-label="Messages">
    ${shown.map(
      (toast) => html`<div class="card ${toast.kind}" key=${toast.number} data-testid="toast">
        ${toast.kind === "error" && html`<span class="said error">${icon("warning")}</span>`}
        <p>${toast.words}</p>
        <button class="button quiet icon" aria-label="Close" onClick=${() => toasts.close(toast)}>${icon("close")}</button>
      </div>`,
    )}
  </div>`;
}
