/** The floor plan on the floor: the pelvis's path, where the body faces at even times, and the edge of the stage. */

import { Group } from "three";
import { strips } from "motionmind/lines";

const MOST = 40; // arrows, as in `motionmind plan`
const ARROW = 0.3; // metres, for a body 1.70 m tall
const BARB = 0.09;
const [PATH, FACING] = ["#7f7f86", "#2a9463"]; // seen on light paper and on dark

export class Plan {
  /** @param {Stage} stage whose movement it draws, on its floor @param {[number, number]} [area] width and depth, metres */
  constructor(stage, area) {
    this.stage = stage;
    this.area = area;
  }

  /** Whether it is seen. */
  get shown() {
    return this.group?.visible ?? false;
  }

  set shown(value) {
    if (value && !this.group) {
      this.group = drawn(this.stage);
      this.stage.layers[0].add(this.group);
    }
    if (this.group) this.group.visible = value;
    this.stage.area = value ? this.area : undefined;
  }
}

/** Draw the plan of a stage's movement. */
function drawn({ motion, body, colours }) {
  const group = new Group();
  const size = body.size;
  const [given, inserted] = [[], []];
  for (let frame = 1; frame < motion.length; frame++) {
    const made = motion.insertedAt(0.5 * (motion.times[frame - 1] + motion.times[frame]));
    (made ? inserted : given).push([place(motion, frame - 1), place(motion, frame)]);
  }
  group.add(strips(given, size, PATH), strips(inserted, size, `rgb(${colours.inserted.middle.join()})`));
  const arrows = facings(motion).map(({ at, towards }) => {
    const tip = [at[0] + ARROW * size * towards[0], at[1] + ARROW * size * towards[1]];
    const barbs = [1, -1].map((side) => [
      tip[0] - BARB * size * (towards[0] + 0.6 * side * towards[1]),
      tip[1] - BARB * size * (towards[1] - 0.6 * side * towards[0]),
    ]);
    return [[at, tip], ...barbs.map((barb) => [barb, tip])];
  });
  group.add(strips(arrows.flat(), size, FACING));
  return group;
}

/** Where the body stands and faces at every so many seconds: `at` and `towards`, x and z. */
export function facings(motion) {
  let every = 1;
  while ((motion.end - motion.start) / every > MOST) every *= 2;
  const rotations = new Float64Array(motion.joints.length * 4);
  const root = new Float64Array(3);
  const found = [];
  for (let time = motion.start; time <= motion.end + 1e-6; time += every) {
    motion.sample(time, rotations, root);
    const [, y, , w] = rotations; // its turn about the vertical, as `motionmind.geometry.rotations.heading`
    const heading = 2 * Math.atan2(y, w);
    found.push({ at: [root[0], root[2]], towards: [Math.sin(heading), Math.cos(heading)] });
  }
  return found;
}

function place(motion, frame) {
  return [motion.root[frame * 3], motion.root[frame * 3 + 2]];
}
