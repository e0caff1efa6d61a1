/** The keys of the page: one table for their actions and for the sheet that lists them. */

const inserted = (motion) => motion.insertions.length > 0;
const joining = (motion) => motion.insertions.some((insertion) => motion.ends(insertion).length > 0);
const moving = (motion) => motion.length > 1;
const alone = (motion) => moving(motion) && !motion.dancers;
const sounding = (motion) => Boolean(motion.sound);

/** Each row: the keys, their labels, what they do, the name of the action, and the motions that have it. */
export const KEYS = [
  { keys: [" "], shown: ["Space"], does: "play or pause", action: "play", when: moving },
  { keys: ["ArrowLeft"], shown: ["←"], does: "one frame back", action: "back", when: moving },
  { keys: ["ArrowRight"], shown: ["→"], does: "one frame forward", action: "forward", when: moving },
  { keys: ["Home"], shown: ["Home"], does: "go to the start", action: "home", when: moving },
  { keys: ["End"], shown: ["End"], does: "go to the end", action: "end", when: moving },
  { keys: ["p"], shown: ["P"], does: "previous insertion", action: "previous", when: inserted },
  { keys: ["n"], shown: ["N"], does: "next insertion", action: "next", when: inserted },
  { shown: ["Tab", "←", "→"], does: "on the timeline: from insertion to insertion; Enter goes there", when: inserted },
  { keys: ["l"], shown: ["L"], does: "loop: restart at the end", action: "loop", when: moving },
  { keys: ["s"], shown: ["S"], does: "sound on or off", action: "sound", when: sounding },
  { keys: ["1"], shown: ["1"], does: "from the front", action: "front" },
  { keys: ["2"], shown: ["2"], does: "from the side", action: "side" },
  { keys: ["3"], shown: ["3"], does: "from above", action: "top" },
  { keys: ["4"], shown: ["4"], does: "three quarters from the front, slightly from above", action: "quarter" },
  { keys: ["f"], shown: ["F"], does: "floor plan: the path and the facings, from above", action: "plan", when: alone },
  { keys: ["r"], shown: ["R"], does: "reset the view", action: "reset" },
  { shown: ["Shift", "arrows"], does: "rotate, like dragging" },
  { shown: ["+", "-"], does: "zoom, like scrolling" },
  { keys: ["a"], shown: ["A"], does: "the end postures A and B", action: "ends", when: joining },
  { keys: ["o"], shown: ["O"], does: "onion skin: frames before and after", action: "onion", when: alone },
  { keys: ["c"], shown: ["C"], does: "legend of the colours", action: "legend" },
  { keys: ["d"], shown: ["D"], does: "dark or light background", action: "dark" },
  { keys: ["?"], shown: ["?"], does: "these keys", action: "help" },
];

const TURN = Math.PI / 24; // radians, by an arrow
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

/** Rotate or zoom a camera if the key does so; return whether it does. */
export function orbit(event, controls) {
  const act = (event.shiftKey && TURNS[event.key]) || STEPS[event.key];
  if (!act || event.ctrlKey || event.metaKey || event.altKey) return false;
  event.preventDefault();
  controls.dispatchEvent({ type: "start" });
  act(controls);
  controls.dispatchEvent({ type: "end" });
  return true;
}

/** Bind keys to `actions`, by name, except where an element needs the key itself. */
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

/** Write the rows that apply to a motion into the sheet's list. */
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
