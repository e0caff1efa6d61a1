/** Shift a video or music against the piece, by drags and keys. */

import { useRef, useState } from "../vendor/htm-preact-standalone.js";

const PAGE_STEP_S = 1;
export const MOST_S = 36_000;

/**
 * What a slider needs that shifts something: the value in use, {draft, shift, keep}, and its handlers.
 * @param {object} how
 * @param {number} how.value seconds, as the project has it
 * @param {number} how.digits of a second that count
 * @param {number} how.step seconds of an arrow key
 * @param {() => number} how.perPixel seconds of a drag to the right
 * @param {(seconds: number) => Promise<unknown> | undefined} how.set
 */
export function useShift({ value, digits, step, perPixel, set }) {
  const dragged = useRef(/** @type {{x: number, from: number} | null} */ (null));
  const [draft, setDraft] = useState(/** @type {number | null} */ (null));
  const now = draft ?? value;
  const latest = useRef(now); // keys come faster than pictures
  latest.current = now;
  const sending = useRef(false);
  const shift = (/** @type {number} */ seconds) => {
    const rounded = Number(Math.min(Math.max(seconds, -MOST_S), MOST_S).toFixed(digits));
    latest.current = rounded;
    setDraft(rounded);
    return rounded;
  };
  const keep = async () => {
    if (sending.current) return; // which goes on to the latest
    sending.current = true;
    let sent = value;
    while (latest.current !== sent) {
      sent = latest.current;
      await set(sent); // one after the other: two at once may arrive in the other order
    }
    sending.current = false;
    setDraft((one) => (one === sent ? null : one)); // unless it has moved on
  };
  const drop = () => {
    dragged.current = null;
    keep();
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const by = { ArrowRight: step, ArrowUp: step, ArrowLeft: -step, ArrowDown: -step, PageUp: PAGE_STEP_S, PageDown: -PAGE_STEP_S }[event.key];
    if (!by && event.key !== "Home") return;
    event.preventDefault();
    shift(by ? latest.current + by : 0);
  };
  const handlers = {
    onPointerDown: (/** @type {PointerEvent} */ event) => {
      if (event.button !== 0) return;
      /** @type {Element} */ (event.currentTarget).setPointerCapture(event.pointerId);
      dragged.current = { x: event.clientX, from: now };
    },
    onPointerMove: (/** @type {PointerEvent} */ event) => dragged.current && shift(dragged.current.from + perPixel() * (event.clientX - dragged.current.x)),
    onPointerUp: drop,
    onPointerCancel: drop,
    onKeyDown: press,
    onKeyUp: keep,
    onBlur: keep,
  };
  return { now, shift, keep, handlers };
}
