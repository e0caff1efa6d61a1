/** The page's keys: one table for their actions and for the sheet of keys. */

import { orbit } from "motionmind/keys";

/**
 * @typedef {object} Row
 * @property {string[]} [keys] what `event.key` is; with "Ctrl+" and "Shift+" before
 * @property {string[]} [shown] labels; by default those of `keys`
 * @property {string} does description
 * @property {string} [group] heading in the sheet
 * @property {(event: KeyboardEvent) => unknown} [act] the action; false leaves the key to other rows
 */

const SHOWN = /** @type {Record<string, string>} */ ({ " ": "Space", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓" });
// Elements that need some keys for themselves.
const WRITING = "input:not([type=range]):not([type=checkbox]):not([type=radio]), textarea, select, [contenteditable]";
const PRESSING = "button, summary, a[href], [role=button], [role=tab], [role=option], input";
const RANGE_KEYS = /^(arrow\w+|home|end|page(up|down))$/; // of a slider or a list

const EVERYWHERE = "Everywhere";

export class Keys extends EventTarget {
  constructor() {
    super();
    /** @type {Row[]} */
    this.rows = [];
    /** @type {() => any} the camera's controls, or undefined */
    this.controls = () => undefined;
    document.addEventListener("keydown", (event) => this.#press(event));
  }

  /**
   * Add rows; the returned function removes them.
   * @param {Row[]} rows
   */
  add(rows) {
    this.rows = [...this.rows, ...rows];
    this.dispatchEvent(new Event("change"));
    return () => {
      this.rows = this.rows.filter((row) => !rows.includes(row));
      this.dispatchEvent(new Event("change"));
    };
  }

  /** The rows by their headings. */
  get groups() {
    /** @type {Map<string, Row[]>} */
    const groups = new Map([[EVERYWHERE, []]]);
    for (const row of this.rows) {
      const group = row.group ?? EVERYWHERE;
      groups.set(group, [...(groups.get(group) ?? []), row]);
    }
    return groups;
  }

  /** @param {KeyboardEvent} event */
  #press(event) {
    if (event.defaultPrevented || !(event.target instanceof Element) || document.querySelector("dialog:modal")) return;
    const name = named(event).toLowerCase();
    if (event.target.closest(WRITING) && !(name.startsWith("ctrl+") && event.target.matches("select"))) return;
    if ((name === " " || name === "enter") && event.target.closest(PRESSING)) return;
    if (RANGE_KEYS.test(name) && event.target.closest("input, [role=slider], [role=listbox], [role=tablist]")) return;
    const controls = this.controls();
    if (controls && orbit(event, controls)) return;
    // Later rows take precedence.
    for (const row of [...this.rows].reverse()) {
      if (row.act && row.keys?.some((key) => key.toLowerCase() === name) && row.act(event) !== false) {
        event.preventDefault();
        return;
      }
    }
  }
}

/** @param {KeyboardEvent} event */
function named(event) {
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const shift = event.shiftKey && (event.key.length > 1 || event.ctrlKey || event.metaKey || key !== event.key) ? "Shift+" : "";
  return (event.ctrlKey || event.metaKey ? "Ctrl+" : "") + (event.altKey ? "Alt+" : "") + shift + key;
}

/**
 * Return the labels of a row's keys.
 * @param {Row} row
 */
export function shownKeys(row) {
  return row.shown ?? (row.keys ?? []).map((key) => key.split("+").map((part) => SHOWN[part] ?? capital(part)).join("+"));
}

/** @param {string} key */
function capital(key) {
  return key.length === 1 ? key.toUpperCase() : key;
}

