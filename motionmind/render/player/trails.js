/** Trails: the paths of hands, feet or pelvis around a moment, as tubes on the graphics card. */

import { Instances, TUBE } from "motionmind/figure";

const SPAN = 1.2; // seconds that a trail leads back, and ahead
const STEP = 1 / 15; // seconds from one place to the next
const COUNT = 2 * Math.ceil(SPAN / STEP) + 1; // pieces of a trail, at most
const RADIUS = 0.011; // metres, of a body of human size, where the joint is now
const THINNEST = 0.25; // share of that at both ends
const [NOW, BEFORE, AFTER] = [1, 0.6, 0.3]; // strength at the moment, and at each end: what is to come is paler

export class Trails {
  /** @param {Body} body @param {object} colours {given, inserted} @param {object} uniforms those of a figure */
  constructor(body, colours, uniforms) {
    Object.assign(this, { body, colours });
    const most = COUNT * Object.values(body.trails).flat().length;
    this.tubes = new Instances("cone", 1, TUBE, uniforms, { step: new Array(most).fill(0) });
    this.mesh = this.tubes.solid;
    this.motion = undefined;
    this.known = new Map(); // by the number of steps from time 0: the posture's joints
  }

  /** Draw the trails of parts ("hands", "feet", "pelvis"), as far as the body has them, around the moment `time`. */
  show(motion, time, parts) {
    if (motion !== this.motion) this.forget();
    this.motion = motion;
    const joints = parts.flatMap((part) => this.body.trails[part] ?? []);
    if (joints.length === 0) {
      if (this.mesh.visible) this.tubes.show(0);
      return;
    }
    const [begin, end] = [Math.max(time - SPAN, motion.start), Math.min(time + SPAN, motion.end)];
    const [first, last] = [Math.ceil(begin / STEP), Math.floor(end / STEP)];
    let count = 0;
    for (let step = first; step < last; step++) {
      const middle = (step + 0.5) * STEP;
      const palette = this.colours[motion.insertedAt(middle) ? "inserted" : "given"];
      const [a, b] = [this.#at(step), this.#at(step + 1)];
      for (const { joint, paint } of joints) {
        this.#tube(count, a, b, joint, [step * STEP - time, (step + 1) * STEP - time]);
        const far = Math.abs(middle - time) / SPAN;
        const strength = NOW + ((middle < time ? BEFORE : AFTER) - NOW) * Math.min(far, 1);
        this.tubes.colour(count, palette[paint].map((value) => value / 255), strength);
        count++;
      }
    }
    this.tubes.show(count);
  }

  /** Forget the places of joints. */
  forget() {
    this.known.clear();
  }

  /** The places of all joints so many steps from time 0 [J * 3]. */
  #at(step) {
    const known = this.known.get(step);
    if (known) return known;
    const { body, motion } = this;
    const [rotations, root] = [new Float64Array(motion.joints.length * 4), new Float64Array(3)];
    motion.sample(step * STEP, rotations, root);
    body.pose(rotations, root);
    const found = Float32Array.from(body.joints);
    this.known.set(step, found);
    return found;
  }

  /** Put a piece of a joint's path, with both ends' times from now. */
  #tube(index, a, b, joint, times) {
    const { array } = this.tubes.places;
    [a, b].forEach((places, end) => {
      const at = index * 8 + end * 4;
      for (let i = 0; i < 3; i++) array[at + i] = places[joint * 3 + i];
      const far = Math.min(Math.abs(times[end]) / SPAN, 1);
      array[at + 3] = RADIUS * this.body.size * (1 + (THINNEST - 1) * far);
    });
  }
}
