/** What is asked for once, though a button is clicked twice or a key is pressed twice. */

const DOUBLE = 300; // milliseconds in which a second click or key is of the same wish

/**
 * A function that does something unless the same, by its name, is still being done or was begun a moment ago.
 * @param {(doing: () => Promise<any>) => Promise<any>} act does something, and says why it failed
 * @returns {(name: string, doing: () => Promise<any>) => Promise<any>}
 */
export function oncer(act) {
  /** @type {Set<string>} */
  const begun = new Set();
  return async (name, doing) => {
    if (begun.has(name)) return undefined;
    begun.add(name);
    const settled = new Promise((done) => setTimeout(done, DOUBLE));
    const found = await act(doing);
    settled.then(() => begun.delete(name));
    return found;
  };
}
