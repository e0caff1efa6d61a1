/** Up to four movements in step, drawn by one renderer with one camera: a browser allows few renderers. */

import { MOMENT } from "motionmind/motion";
import { Pictures } from "motionmind/pictures";
import { Player } from "motionmind/player";
import { Stage } from "motionmind/stage";
import { Vector3 } from "three";

const DRAG_TURN_RAD = Math.PI; // by a drag across the whole picture
export const CLICK_SLACK_PX = 3; // CSS pixels
const JOINT_RADIUS_PX = 36; // CSS pixels from a joint within which the pointer hits it
const GHOSTS = { ends: true, onion: 0 };

/** Movements in sequence, with enough of `Motion` for a stage to frame all of them. */
class All {
  /** @param {any[]} motions */
  constructor(motions) {
    this.motions = motions;
    this.joints = motions[0].joints;
    this.starts = [0];
    for (const motion of motions) this.starts.push(this.starts[this.starts.length - 1] + motion.length);
    this.length = this.starts[motions.length];
    this.times = Array.from({ length: this.length }, (_, i) => i);
    this.farthest = motions.flatMap((motion, i) => motion.farthest.map((/** @type {number} */ at) => at + this.starts[i]));
  }

  /** @param {number} time @param {Float64Array} rotations @param {Float64Array} root */
  sample(time, rotations, root) {
    const i = this.starts.findLastIndex((start) => start <= time);
    this.motions[i].sample(this.motions[i].times[time - this.starts[i]], rotations, root);
  }
}

/** The stage, player and pictures that the alternatives share. */
export class Quartet {
  /** @param {boolean} dark */
  constructor(dark) {
    this.dark = dark;
    /** Holds the renderer's canvas, hidden, inside one of the pictures, so that it has their size. */
    this.room = Object.assign(document.createElement("div"), { className: "room" });
    /** @type {any} */
    this.stage = undefined;
    /** @type {any[]} */
    this.motions = [];
    /** @type {CanvasRenderingContext2D[]} */
    this.pens = [];
    /** @type {(number | null)[]} the marked joint of each */
    this.marked = [];
    /** @type {any} */
    this.player = new Player(/** @type {any} */ ({ length: 1, start: 0, end: 0, times: [0], frameAt: () => 0 }));
    this.pictures = new Pictures(this.player, () => this.#draw());
    this.ended = false;
  }

  /** Play these movements. @param {any[]} motions @param {boolean} still whether not to start */
  take(motions, still) {
    const first = this.motions.length === 0;
    this.motions = motions;
    if (motions.length === 0) return;
    const all = new All(motions);
    const [{ body, colours }] = motions;
    if (this.stage) this.stage.take(all, body, colours);
    else {
      const canvas = document.createElement("canvas");
      this.room.append(canvas);
      this.stage = new Stage(canvas, /** @type {any} */ (all), body, colours, () => this.pictures.ask());
      this.stage.dark = this.dark;
    }
    this.stage.look(this.stage.view ?? "quarter");
    this.player.motion = motions.reduce((one, other) => (other.end > one.end ? other : one));
    if (first) this.player.seek(0);
    if (first && !still) this.player.play();
    this.pictures.ask();
  }

  /** @param {boolean} dark */
  colour(dark) {
    this.dark = dark;
    if (this.stage) this.stage.dark = dark;
    this.pictures.ask();
  }

  /** Draw a movement onto a canvas. @param {number} index @param {HTMLCanvasElement} canvas */
  onto(index, canvas) {
    this.pens[index] = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
    this.pictures.ask();
  }

  /** Turn all pictures. @param {number} across share of a picture's width @param {number} along share of its height */
  turn(across, along) {
    const { controls } = this.stage;
    this.stage.view = undefined;
    controls.rotateLeft(DRAG_TURN_RAD * across);
    controls.rotateUp(DRAG_TURN_RAD * along);
  }

  /** Zoom all pictures. @param {number} factor */
  zoom(factor) {
    this.stage.view = undefined;
    this.stage.controls.dollyIn(factor);
  }

  /**
   * The joint of a movement nearest to a position in its picture; null if none is near.
   * @param {number} index
   * @param {number} x CSS pixels from the left
   * @param {number} y CSS pixels from the top
   * @returns {number | null}
   */
  jointAt(index, x, y) {
    const { stage } = this;
    const motion = this.motions[index];
    if (!motion || !stage) return null;
    const { clientWidth: width, clientHeight: height } = this.room;
    motion.sample(this.#timeOf(motion), stage.rotations, stage.root);
    stage.body.pose(stage.rotations, stage.root);
    const place = new Vector3();
    let best = null;
    let least = JOINT_RADIUS_PX;
    for (let joint = 0; joint < motion.joints.length; joint++) {
      place.fromArray(stage.body.joints, joint * 3).project(stage.camera);
      const distance = Math.hypot((0.5 + 0.5 * place.x) * width - x, (0.5 - 0.5 * place.y) * height - y);
      if (distance < least) [best, least] = [joint, distance];
    }
    return best;
  }

  /** Mark a joint of a movement, or none. @param {number} index @param {number | null} joint */
  mark(index, joint) {
    this.marked[index] = joint;
    this.pictures.ask();
  }

  end() {
    this.ended = true;
    this.player.pause();
    this.stage?.renderer.dispose();
    this.stage?.renderer.forceContextLoss();
  }

  /** @param {any} motion */
  #timeOf(motion) {
    return Math.min(this.player.time, motion.end - MOMENT / 10);
  }

  #draw() {
    if (this.ended || !this.stage || this.room.clientWidth === 0) return;
    this.motions.forEach((motion, i) => this.#picture(motion, i));
  }

  /** @param {any} motion @param {number} index */
  #picture(motion, index) {
    const { stage } = this;
    const pen = this.pens[index];
    if (!pen) return;
    Object.assign(stage, { motion, ghostsShown: "" });
    stage.show(this.#timeOf(motion), GHOSTS);
    const joint = this.marked[index];
    if (joint !== null && joint !== undefined) stage.marks.show([joint]);
    stage.render(this.player.playing, this.pictures.late);
    const { width, height } = stage.canvas;
    if (pen.canvas.width !== width || pen.canvas.height !== height) Object.assign(pen.canvas, { width, height });
    pen.drawImage(stage.canvas, 0, 0);
  }
}


