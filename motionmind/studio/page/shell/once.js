/** Guard against double clicks and repeated keys. */

const DOUBLE_CLICK_MS = 300;

/**
 * Return a function that runs an action, unless one with the same name still runs or began a moment ago.
 * @param {(doing: () => Promise<any>) => Promise<any>} act runs an action, and shows its error
 * @returns {(name: string, doing: () => Promise<any>) => Promise<any>}
 */
export function oncer(act) {
  /** @type {Set<string>} */
  const begun = new Set();
  return async (name, doing) => {
    if (begun.has(name)) return undefined;
    begun.add(name);
    const settled = new Promise((done) => setTimeout(done, DOUBLE_CLICK_MS));
    const found = await act(doing);
    settled.then(() => begun.delete(name));
    return found;
  };
}
