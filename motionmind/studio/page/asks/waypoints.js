/** When an insertion passes the postures that it was asked to pass. */

/**
 * The times of a movement at which the body is nearest to some postures, in this order.
 * @param {any} motion @param {number} begin @param {number} end of the part to look in, seconds
 * @param {ArrayLike<number>[]} postures local rotations of the same joints [J * 4] each
 */
export function passedAt(motion, begin, end, postures) {
  const rotations = new Float64Array(motion.joints.length * 4);
  const root = new Float64Array(3);
  const times = Array.from(motion.times).filter((time) => begin <= time && time <= end);
  const found = [];
  let from = 0;
  for (const posture of postures) {
    let best = from;
    let least = Infinity;
    for (let i = from; i < times.length; i++) {
      motion.sample(times[i], rotations, root);
      const off = distance(rotations, posture);
      if (off < least) [least, best] = [off, i];
    }
    found.push(times[best]);
    from = best;
  }
  return found;
}

/** How unlike two postures are, whichever way they face: a sum over the joints. @param {ArrayLike<number>} one @param {ArrayLike<number>} other */
function distance(one, other) {
  let sum = 0;
  for (let i = 4; i < one.length; i += 4) {
    const cosine = one[i] * other[i] + one[i + 1] * other[i + 1] + one[i + 2] * other[i + 2] + one[i + 3] * other[i + 3];
    sum += 1 - cosine * cosine;
  }
  return sum;
}
