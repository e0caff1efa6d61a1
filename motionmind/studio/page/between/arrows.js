/** Arrow keys in the gallery: from button to button, in rows. */

const ITEMS = ".thumb, .clip";
const ROW_SLACK_PX = 8; // between the middles of buttons in one row

/** Move the focus as a key says. @param {KeyboardEvent} event */
export function walk(event) {
  const { key, target, currentTarget } = event;
  if (event.shiftKey || event.ctrlKey || event.metaKey || event.altKey || !(target instanceof HTMLElement)) return;
  const items = [.../** @type {HTMLElement} */ (currentTarget).querySelectorAll(ITEMS)].map((one) => /** @type {HTMLElement} */ (one));
  const next = target.matches(ITEMS) ? reached(key, target, items) : target.matches("[type=search]") && key === "ArrowDown" && items[0];
  if (next === undefined || next === false) return;
  event.preventDefault();
  next.focus();
}

/**
 * The item that a key leads to, which is `from` at the end; undefined for other keys.
 * @param {string} key @param {HTMLElement} from @param {HTMLElement[]} items
 */
function reached(key, from, items) {
  const along = { ArrowLeft: -1, ArrowRight: 1 }[key];
  if (along) return items[items.indexOf(from) + along] ?? from;
  if (key === "Home") return items[0];
  if (key === "End") return items.at(-1);
  const down = { ArrowUp: -1, ArrowDown: 1 }[key];
  if (!down) return undefined;
  const [x, y] = middle(from);
  const ahead = items.map((item) => ({ item, at: middle(item) })).filter(({ at }) => down * (at[1] - y) > ROW_SLACK_PX);
  const row = Math.min(...ahead.map(({ at }) => down * at[1]));
  const [best] = ahead.filter(({ at }) => down * at[1] - row < ROW_SLACK_PX).sort((one, other) => Math.abs(one.at[0] - x) - Math.abs(other.at[0] - x));
  return best?.item ?? from;
}

/** @param {Element} item @returns {[number, number]} */
function middle(item) {
  const { left, right, top, bottom } = item.getBoundingClientRect();
  return [(left + right) / 2, (top + bottom) / 2];
}
