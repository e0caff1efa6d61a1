/** The volume of a body: where its round cones and ellipsoids are in a posture. It draws nothing. */

export class Body {
  /** @param {object} skeleton {parents, offsets}  @param {object} data {size, frames, cones, balls, marks, trails} */
  constructor(skeleton, data) {
    this.size = data.size; // 1 for a person 1.70 m tall
    this.cones = data.cones;
    this.balls = data.balls;
    this.marks = data.marks; // radii of the balls that stand out around the joints, metres [J]
    this.trails = data.trails; // by the part's name: joints whose path is drawn, each with its paint
    this.parents = skeleton.parents;
    this.offsets = skeleton.offsets;
    this.frames = data.frames;
    const joints = this.parents.length;
    this.turned = new Float64Array(joints * 4); // rotations of the joints' axes against the world
    this.joints = new Float64Array(joints * 3); // places of the joints, metres
    this.origins = new Float64Array(this.frames.length * 3);
    this.axes = new Float64Array(this.frames.length * 4);
  }

  /** Take the posture of local rotations [J * 4] and the root's place [3]: sets `joints`, and what solids hang from. */
  pose(rotations, root) {
    const { turned, joints } = this;
    for (let joint = 0; joint < this.parents.length; joint++) {
      const parent = this.parents[joint];
      if (parent < 0) {
        for (let i = 0; i < 4; i++) turned[i] = rotations[i];
        for (let i = 0; i < 3; i++) joints[i] = root[i];
      } else {
        multiply(turned, joint * 4, turned, parent * 4, rotations, joint * 4);
        turn(joints, joint * 3, turned, parent * 4, this.offsets[joint]);
        for (let i = 0; i < 3; i++) joints[joint * 3 + i] += joints[parent * 3 + i];
      }
    }
    this.frames.forEach(({ places, turns }, frame) => {
      for (let i = 0; i < 3; i++) {
        this.origins[frame * 3 + i] = 0.5 * (joints[places[0] * 3 + i] + joints[places[1] * 3 + i]);
      }
      halfway(this.axes, frame * 4, turned, turns[0] * 4, turns[1] * 4);
    });
  }

  /** The place [x, y, z] of a point in a joint's frame, metres. */
  place(joint, at) {
    const out = [0, 0, 0];
    turn(out, 0, this.turned, joint * 4, at);
    return out.map((value, i) => value + this.joints[joint * 3 + i]);
  }

  /** Put the posture's cones into `out`, eight numbers each: both ends' centre and radius. */
  writeCones(out, at = 0) {
    for (const cone of this.cones) {
      this.#put(out, at, cone.a_frame, cone.a);
      out[at + 3] = cone.a_radius;
      this.#put(out, at + 4, cone.b_frame, cone.b);
      out[at + 7] = cone.b_radius;
      at += 8;
    }
  }

  /** Put the posture's ellipsoids into `out`, twelve numbers each: the centre and the three half axes. */
  writeBalls(out, at = 0) {
    const axis = [0, 0, 0];
    for (const ball of this.balls) {
      this.#put(out, at, ball.frame, ball.centre);
      for (let i = 0; i < 3; i++) {
        axis.fill(0);
        axis[i] = ball.radii[i];
        turn(out, at + 3 + 3 * i, this.axes, ball.frame * 4, axis);
      }
      at += 12;
    }
  }

  #put(out, at, frame, place) {
    turn(out, at, this.axes, frame * 4, place);
    for (let i = 0; i < 3; i++) out[at + i] += this.origins[frame * 3 + i];
  }
}

/** out = p q: the rotation q, and then p. */
function multiply(out, at, p, i, q, j) {
  const [px, py, pz, pw] = [p[i], p[i + 1], p[i + 2], p[i + 3]];
  const [qx, qy, qz, qw] = [q[j], q[j + 1], q[j + 2], q[j + 3]];
  out[at] = pw * qx + px * qw + py * qz - pz * qy;
  out[at + 1] = pw * qy - px * qz + py * qw + pz * qx;
  out[at + 2] = pw * qz + px * qy - py * qx + pz * qw;
  out[at + 3] = pw * qw - px * qx - py * qy - pz * qz;
}

/** out = the vector [x, y, z] turned by q. */
function turn(out, at, q, i, [x, y, z]) {
  const [qx, qy, qz, qw] = [q[i], q[i + 1], q[i + 2], q[i + 3]];
  const tx = 2 * (qy * z - qz * y);
  const ty = 2 * (qz * x - qx * z);
  const tz = 2 * (qx * y - qy * x);
  out[at] = x + qw * tx + qy * tz - qz * ty;
  out[at + 1] = y + qw * ty + qz * tx - qx * tz;
  out[at + 2] = z + qw * tz + qx * ty - qy * tx;
}

/** out = the rotation half-way between two: half of their sum, the short way round, brought to length 1. */
function halfway(out, at, q, a, b) {
  const sign = q[a] * q[b] + q[a + 1] * q[b + 1] + q[a + 2] * q[b + 2] + q[a + 3] * q[b + 3] < 0 ? -1 : 1;
  let square = 0;
  for (let i = 0; i < 4; i++) {
    out[at + i] = q[a + i] + sign * q[b + i];
    square += out[at + i] ** 2;
  }
  for (let i = 0; i < 4; i++) out[at + i] /= Math.sqrt(square);
}
