/** Fields for numbers. */

/**
 * Hear what is written into a field for a number: `use` returns the number that is in use then, or null for none, and the
 * field shows that.
 * @param {(given: number) => number | string | null} use
 */
export function written(use) {
  return (/** @type {any} */ event) => {
    event.target.value = String(use(Number(event.target.value)) ?? "");
  };
}
