/** The posture in the editor as a `Motion` of the player: one frame, which changes. */

import { Motion } from "motionmind/motion";

export class Posed extends Motion {
  /**
   * @param {any} source a movement on the same body, with `body` and `colours`
   * @param {{rotations: number[], root: number[]}} posture
   */
  constructor(source, posture) {
    super(EMPTY);
    Object.assign(this, { name: source.name, joints: source.joints, body: source.body, colours: source.colours });
    this.times = new Float64Array([0]);
    this.farthest = [0];
    this.take(posture);
  }

  /** @param {{rotations: number[], root: number[]}} posture */
  take({ rotations, root }) {
    this.rotations = Float32Array.from(rotations);
    this.root = Float32Array.from(root);
  }
}

const EMPTY = {
  name: "",
  skeleton: { names: [] },
  times: "",
  root: "",
  rotations: "",
  first: 0,
  farthest: [0],
  insertions: [],
};
