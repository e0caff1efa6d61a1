/** When dancers enter and formations change: by drags and keys, in whole counts. Nothing here knows a view. */

const CLICK_SLACK_PX = 4;

/** How many counts a key moves an entry; Infinity is to the first count. */
export const STEPS = /** @type {Record<string, number>} */ ({ ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1, PageUp: 8, PageDown: -8, Home: -Infinity });

/** An entry moved by some counts; between counts, to the one before or after. @param {number} entry @param {number} by */
export function movedEntry(entry, by) {
  const whole = by > 0 ? Math.floor(entry + 1e-6) : Math.ceil(entry - 1e-6);
  return Math.max(whole + by, 1);
}

/**
 * The changes of formation, one of them at another count, as far as the ones before and after leave room.
 * @param {import("./cast.js").Change[]} changes @param {number} number from 0 @param {number} at
 */
export function retimed(changes, number, at) {
  const [before, after] = [changes[number - 1], changes[number + 1]];
  const first = before ? before.at + before.counts : 1;
  const last = after ? after.at - changes[number].counts : Infinity;
  return changes.map((change, i) => (i === number ? { ...change, at: Math.max(Math.min(at, last), first) } : change));
}

/** A drag along a lane, from pointer down to pointer up. */
export class Drag {
  /** @param {string} name of the item @param {number} count where it is @param {number} x of the pointer, pixels */
  constructor(name, count, x) {
    this.name = name;
    this.count = count;
    this.x = x;
    this.moves = false;
  }

  /** Where the item is now; null for a click. @param {number} x of the pointer @param {number} width of a count, pixels */
  take(x, width) {
    this.moves ||= Math.abs(x - this.x) >= CLICK_SLACK_PX;
    return this.moves ? { name: this.name, count: Math.max(Math.round(this.count + (x - this.x) / width), 1) } : null;
  }
}
