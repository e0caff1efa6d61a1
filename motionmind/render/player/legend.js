/** The legend: the colours of a motion's picture, and their meanings. */

const SIDES = ["left", "right", "middle"];

/**
 * Write a line for each colour into a list.
 * @param {HTMLElement} list
 * @param {Motion} motion
 * @param {Body} body
 * @param {object} colours {given, inserted, bridged}
 */
export function writeLegend(list, motion, body, { given, inserted, bridged }) {
  const paints = new Set([...body.cones, ...body.balls].map(({ paint }) => paint));
  const sides = SIDES.filter((side) => paints.has(side));
  const line = (swatches, words, ghost = false) => {
    const item = document.createElement("li");
    for (const colour of swatches) {
      const swatch = document.createElement("i");
      swatch.style.background = `rgb(${colour.join()})`;
      swatch.classList.toggle("ghost", ghost);
      item.append(swatch);
    }
    item.append(" ", words);
    list.append(item);
  };
  if (paints.has("left")) line([given.left], "left");
  if (paints.has("right")) line([given.right], "right");
  if (paints.has("mark")) line([given.mark], "front of knees and trunk");
  if (motion.insertions.length === 0) return;
  line(sides.map((side) => inserted[side]), "inserted by the engine");
  if (motion.insertions.some((insertion) => insertion.bridged.length > 0)) {
    line([bridged], "bridged: a joint's move that no clip attests");
  }
  if (motion.insertions.some((insertion) => motion.ends(insertion).length > 0)) {
    line(sides.map((side) => given[side]), "A and B: the end postures of an insertion", true);
  }
}
