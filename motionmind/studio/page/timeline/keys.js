/** The time line's keys; the `?` sheet lists the same table. */

/** Each row: `event.key`, modifiers, label, description, action. */
export const KEYS = [
  ["ArrowLeft", "", "←", "previous stretch or insertion", (does) => does.go(-1)],
  ["ArrowRight", "", "→", "next stretch or insertion", (does) => does.go(1)],
  ["ArrowLeft", "alt", "Alt ←", "move the stretch earlier", (does) => does.moveBy(-1)],
  ["ArrowRight", "alt", "Alt →", "move the stretch later", (does) => does.moveBy(1)],
  ["ArrowLeft", "shift", "Shift ←", "end a frame earlier; shorten the insertion or held posture", (does) => does.trimBy("last", -1)],
  ["ArrowRight", "shift", "Shift →", "end a frame later; lengthen the insertion; hold the posture", (does) => does.trimBy("last", 1)],
  ["ArrowLeft", "alt shift", "Alt Shift ←", "begin a frame earlier", (does) => does.trimBy("first", -1)],
  ["ArrowRight", "alt shift", "Alt Shift →", "begin a frame later", (does) => does.trimBy("first", 1)],
  ["ArrowLeft", "ctrl shift", "Ctrl Shift ←", "select the stretch before, too", (does) => does.extend(-1)],
  ["ArrowRight", "ctrl shift", "Ctrl Shift →", "select the stretch after, too (or Shift and click)", (does) => does.extend(1)],
  ["ArrowUp", "", "↑", "previous alternative", (does) => does.flip(-1)],
  ["ArrowDown", "", "↓", "next alternative", (does) => does.flip(1)],
  ["Enter", "", "Enter", "go to its start", (does) => does.seek((does.item?.block ?? does.item?.seam)?.at ?? 0)],
  ["s", "", "S", "split the stretch at the playhead", (does) => does.split()],
  [",", "", ", .", "play the stretch slower or faster", (does) => does.paceBy(-1)],
  [".", "", "", "", (does) => does.paceBy(1)],
  ["r", "", "R", "repeat the stretch once more", (does) => does.repeatBy(1)],
  ["r", "alt", "Alt R", "repeat it once less", (does) => does.repeatBy(-1)],
  ["d", "", "D", "duplicate the stretch", (does) => does.duplicate()],
  ["m", "", "M", "mirror the stretch", (does) => does.mirror()],
  ["Delete", "", "Delete", "delete the stretch; discard or restore the insertion", (does) => does.remove()],
  ["Backspace", "", "", "", (does) => does.remove()],
  ["u", "", "U", "lock or unlock the insertion", (does) => does.lock()],
  ["w", "", "W", "wishes for the insertion: duration, postures, hands and feet", (does) => does.item?.seam && does.show({ sheet: true })],
  ["Escape", "", "", "", (does) => (does.single(), does.show({ sheet: false }))],
  ["g", "", "G", "snap edges, insertions and the playhead to counts, or not", (does) => does.snap()],
  ["+", "", "+ −", "zoom", (does) => does.zoomIn()],
  ["=", "", "", "", (does) => does.zoomIn()],
  ["-", "", "", "", (does) => does.zoomOut()],
  ["0", "", "0", "show the whole piece", (does) => does.fit()],
];

/** Run a key's action; return whether it has one. */
export function act(event, table, does) {
  const held = [
    event.altKey && "alt",
    (event.ctrlKey || event.metaKey) && "ctrl",
    event.shiftKey && event.key.length > 1 && "shift",
  ]
    .filter(Boolean)
    .join(" ");
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const row = table.find(([name, with_]) => name === key && with_ === held);
  if (!row) return false;
  event.preventDefault();
  event.stopPropagation();
  row[4](does);
  return true;
}
