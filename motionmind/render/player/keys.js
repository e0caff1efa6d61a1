/** The keys of the page: one table, by which they act and which the sheet shows. */

const inserted = (motion) => motion.insertions.length > 0;
const joining = (motion) => motion.insertions.some((insertion) => motion.ends(insertion).length > 0);
const moving = (motion) => motion.length > 1;

/** Each row: the keys, how they are shown, what they do, the name of the action, and for which motions there are any. */
export const KEYS = [
  { keys: [" "], shown: ["Space"], does: "play or pause", action: "play", when: moving },
  { keys: ["ArrowLeft"], shown: ["←"], does: "one frame back", action: "back", when: moving },
  { keys: ["ArrowRight"], shown: ["→"], does: "one frame on", action: "forward", when: moving },
  { keys: ["Home"], shown: ["Home"], does: "the start", action: "home", when: moving },
  { keys: ["End"], shown: ["End"], does: "the end", action: "end", when: moving },
  { keys: ["p"], shown: ["P"], does: "the insertion before", action: "previous", when: inserted },
  { keys: ["n"], shown: ["N"], does: "the next insertion", action: "next", when: inserted },
  { shown: ["Tab", "←", "→"], does: "on the line of time: from insertion to insertion, and Enter goes there", when: inserted },
  { keys: ["l"], shown: ["L"], does: "loop: from the end to the start", action: "loop", when: moving },
  { keys: ["1"], shown: ["1"], does: "from the front", action: "front" },
  { keys: ["2"], shown: ["2"], does: "from the side", action: "side" },
  { keys: ["3"], shown: ["3"], does: "from above", action: "top" },
  { keys: ["4"], shown: ["4"], does: "half from the side, a little from above", action: "quarter" },
  { keys: ["r"], shown: ["R"], does: "the view at the start", action: "reset" },
  { shown: ["Shift", "arrows"], does: "turn the picture, as dragging does" },
  { shown: ["+", "-"], does: "nearer, farther, as scrolling does" },
  { keys: ["a"], shown: ["A"], does: "the postures A and B", action: "ends", when: joining },
  { keys: ["o"], shown: ["O"], does: "onion skin: frames before and after", action: "onion", when: moving },
  { keys: ["c"], shown: ["C"], does: "what the colours mean", action: "legend" },
  { keys: ["d"], shown: ["D"], does: "dark paper, or light", action: "dark" },
  { keys: ["?"], shown: ["?"], does: "these keys", action: "help" },
];

const TURN = Math.PI / 24; // by an arrow
const NEARER = 0.9;
const TURNS = {
  ArrowLeft: (controls) => controls.rotateLeft(TURN),
  ArrowRight: (controls) => controls.rotateLeft(-TURN),
  ArrowUp: (controls) => controls.rotateUp(TURN),
  ArrowDown: (controls) => controls.rotateUp(-TURN),
};
const STEPS = {
  "+": (controls) => controls.dollyIn(NEARER),
  "=": (controls) => controls.dollyIn(NEARER), // the same key without Shift
  "-": (controls) => controls.dollyIn(1 / NEARER),
};

/** Turn a camera, or bring it nearer, if the key is one that does so; returns whether it is. */
export function orbit(event, controls) {
  const act = (event.shiftKey && TURNS[event.key]) || STEPS[event.key];
  if (!act || event.ctrlKey || event.metaKey || event.altKey) return false;
  event.preventDefault();
  controls.dispatchEvent({ type: "start" });
  act(controls);
  controls.dispatchEvent({ type: "end" });
  return true;
}

/** Let keys do what `actions` hold, by name; a key that an element needs for itself is left to it. */
export function listen(actions, motion, controls) {
  const acting = new Map();
  for (const { keys = [], action, when } of KEYS) {
    if (!when || when(motion)) for (const key of keys) acting.set(key, actions[action]);
  }
  document.addEventListener("keydown", (event) => {
    const own = event.target.closest("select, dialog") || (event.key === " " && event.target.closest("button, summary"));
    if (own || orbit(event, controls)) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (event.ctrlKey || event.metaKey || event.altKey || !acting.has(key)) return;
    event.preventDefault();
    acting.get(key)();
  });
}

/** Write the rows that a motion has into the sheet's list. */
export function writeKeys(list, motion) {
  for (const { shown, does, when } of KEYS) {
    if (when && !when(motion)) continue;
    const keys = shown.flatMap((name, i) => [...(i > 0 ? [" "] : []), made("kbd", name)]);
    list.append(made("dt", ...keys), made("dd", does));
  }
}

function made(tag, ...content) {
  const element = document.createElement(tag);
  element.append(...content);
  return element;
}
