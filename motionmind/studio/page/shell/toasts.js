/** One line for what went wrong, or right, at the edge of the page. */

import { html } from "../vendor/htm-preact-standalone.js";
import { useChange } from "./hooks.js";
import { icon } from "./icons.js";

const LASTS = 8000; // milliseconds that a note stays; an error stays until it is closed, or three more have come
const MOST = 3;

/** @typedef {{words: string, kind: "error" | "note", number: number}} Toast */

export class Toasts extends EventTarget {
  constructor() {
    super();
    /** @type {Toast[]} */
    this.shown = [];
    this.count = 0;
  }

  /**
   * Show a line; the same again is not shown twice.
   * @param {string} words
   * @param {{kind?: "error" | "note"}} how
   */
  say(words, { kind = "note" } = {}) {
    const toast = { words, kind, number: ++this.count };
    this.#set([...this.shown.filter((other) => other.words !== words), toast].slice(-MOST));
    if (kind === "note") setTimeout(() => this.close(toast), LASTS);
  }

  /** @param {Toast} toast */
  close(toast) {
    this.#set(this.shown.filter((other) => other !== toast));
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
