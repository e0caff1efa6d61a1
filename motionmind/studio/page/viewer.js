/** The viewer: one movement, or two side by side, seen from one camera. It knows no edits. */

import { GroupStage } from "motionmind/group";
import { Pictures } from "motionmind/pictures";
import { Player } from "motionmind/player";
import { Stage } from "motionmind/stage";
import { Theme } from "motionmind/theme";

const CAMERA_SLACK_RATIO = 0.1; // the camera follows a movement that shifts by more than this share of its reach
const REST_MS = 150; // without a change, until a picture drawn without a GPU is drawn finely
const STILL = { length: 1, start: 0, end: 0, times: [0], frameAt: () => 0 }; // while there is nothing to show

/** A stage on a canvas of its own in `half`. @param {HTMLElement} half @param {any} motion @param {() => void} changed */
function stageIn(half, motion, changed) {
  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "The body in 3D: drag to rotate, scroll to zoom");
  half.append(canvas);
  return stageOf(canvas, motion, changed);
}

/** A stage for a movement, or for all dancers of one. @param {HTMLCanvasElement} canvas @param {any} motion @param {() => void} changed */
export function stageOf(canvas, motion, changed) {
  return new (motion.dancers ? GroupStage : Stage)(canvas, motion, motion.body, motion.colours, changed);
}

/** Fires "show" when another movement is shown, and "draw" after each picture. */
export class Viewer extends EventTarget {
  #covered = false;
  #rests = false;
  /** @type {number[] | undefined} */
  #area;
  #resting = 0; // the timer that lets it rest

  constructor() {
    super();
    this.theme = new Theme();
    this.player = new Player(/** @type {any} */ (STILL));
    this.element = made("stage");
    this.halves = [made("half"), made("half")];
    this.crowd = Object.assign(made("crowd"), { hidden: true }); // in place of the first half, for several dancers
    this.overlay = made("overlay");
    this.element.append(this.crowd, this.halves[0], this.overlay);
    this.title = "";
    /** What is drawn besides the body, as `Stage.show` takes it. */
    this.ghosts = { ends: true, onion: 0, trails: /** @type {string[]} */ ([]), waypoints: /** @type {number[]} */ ([]) };
    this.isHome = true;
    /** @type {any} */
    this.motion = undefined;
    /** @type {any} */
    this.beside = undefined;
    /** @type {any} */
    this.piece = undefined;
    /** @type {any} the one in view */
    this.stage = undefined;
    /** @type {Map<HTMLElement, any>} the stages of the first half and of the crowd */
    this.kept = new Map();
    /** @type {any} */
    this.other = undefined;
    /** @type {{middle: any, reach: number} | undefined} the region of movement that the camera was set up for */
    this.framed = undefined;
    this.pictures = new Pictures(this.player, () => this.#draw());
    this.theme.addEventListener("change", () => this.#colour());
    this.#colour();
  }

  /** Whether something else covers it. */
  get covered() {
    return this.#covered;
  }

  set covered(value) {
    this.#covered = value;
    this.stale();
  }

  /**
   * Show the piece, now or when the user returns to it.
   * @param {any} motion
   * @param {{time?: number}} how
   */
  home(motion, { time } = {}) {
    this.piece = motion;
    if (this.isHome || !this.motion) this.#take(motion, { time, title: "", home: true, look: false });
    else this.dispatchEvent(new Event("show")); // there is a piece to return to
  }

  /** Forget the piece, which is empty now; another movement stays in view. */
  clear() {
    this.piece = undefined;
    if (!this.isHome || !this.motion) return;
    Object.assign(this, { motion: undefined, beside: undefined, title: "" });
    for (const half of [...this.halves, this.crowd]) half.hidden = true;
    this.player.pause();
    this.player.motion = /** @type {any} */ (STILL);
    this.player.seek(0);
    this.dispatchEvent(new Event("show"));
  }

  /** Show the piece again. */
  back() {
    this.isHome = true; // also if the piece is yet to load
    if (this.piece) this.#take(this.piece, { title: "", home: true, look: true });
    else this.dispatchEvent(new Event("show"));
  }

  /**
   * Show a movement that is not the piece.
   * @param {any} motion a Motion, or an object with its interface, with `body` and `colours`
   * @param {{time?: number, beside?: any, title?: string, besideTitle?: string, play?: boolean, look?: boolean}} how
   */
  show(motion, { time, beside, title = "", besideTitle = "", play = false, look = true } = {}) {
    this.halves[1].dataset.title = besideTitle;
    this.#take(motion, { time, beside, title, look, home: false });
    if (play && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.player.play();
  }

  /** Draw the edge of the stage on the floor, [width, depth] in metres; undefined for none. */
  set area(/** @type {number[] | undefined} */ area) {
    this.#area = area;
    for (const stage of [...this.kept.values(), this.other]) if (stage) stage.area = area;
    this.stale();
  }

  /** Draw other things besides the body. @param {Partial<Viewer["ghosts"]>} change */
  besides(change) {
    Object.assign(this.ghosts, change);
    this.stale();
  }

  /** Request a new picture. */
  stale() {
    this.pictures.ask();
  }

  /** Look from "front", "side", "top" or "quarter". @param {string} from */
  look(from) {
    this.stage?.look(from);
    this.other?.look(from);
    this.framed = this.stage && { middle: this.stage.middle, reach: this.stage.reach };
    this.stale();
  }

  /** The movement's key and frame in view; null if unknown. */
  get moment() {
    const { motion, player } = this;
    if (!motion) return null;
    if (motion.placeAt) return motion.placeAt(player.time);
    return motion.key ? { key: motion.key, frame: player.frame } : null;
  }

  /** The time of what is danced: of several dancers, the first one's. */
  get own() {
    return this.motion?.own?.(this.player.time) ?? this.player.time;
  }

  /** The player's time at a time of what is danced: when the first of several dancers is there. @param {number} own */
  clock(own) {
    return this.motion?.clock?.(own) ?? own;
  }

  /** @param {any} motion @param {{time?: number, beside?: any, title: string, look: boolean, home: boolean}} how */
  #take(motion, { time, beside, title, look, home }) {
    Object.assign(this, { motion, beside, title, isHome: home });
    try {
      this.#stages(look);
    } catch (error) {
      this.#fail(error);
    }
    this.player.motion = longer(motion, beside);
    this.player.seek(time ?? this.player.time);
    this.stale();
    this.dispatchEvent(new Event("show"));
  }

  /** @param {boolean} look */
  #stages(look) {
    const { motion, beside } = this;
    this.element.classList.toggle("two", Boolean(beside));
    if (beside && !this.halves[1].isConnected) this.halves[0].after(this.halves[1]);
    const [half, unused] = motion.dancers ? [this.crowd, this.halves[0]] : [this.halves[0], this.crowd];
    half.hidden = false;
    unused.hidden = true;
    this.halves[1].hidden = !beside;
    const kept = this.kept.get(half);
    kept?.take(motion, motion.body, motion.colours);
    if (this.stage !== kept) this.framed = undefined; // another camera
    this.stage = kept ?? this.#stage(half, motion);
    this.kept.set(half, this.stage);
    if (beside && !this.other) this.other = this.#stage(this.halves[1], beside);
    else if (beside) this.other.take(beside, beside.body, beside.colours);
    if (look || this.#strays()) this.look(this.stage.view ?? "quarter");
  }

  /** Whether the movement goes elsewhere than the one that the camera was set up for, and the user has not turned it since. */
  #strays() {
    const { middle, reach, view } = this.stage;
    const before = this.framed;
    return Boolean(view) && (!before || before.middle.distanceTo(middle) + Math.abs(before.reach - reach) > CAMERA_SLACK_RATIO * reach);
  }

  /** @param {HTMLElement} half @param {any} motion */
  #stage(half, motion) {
    const stage = stageIn(half, motion, () => {
      this.#follow(half);
      this.stale();
    });
    stage.dark = this.theme.dark;
    stage.area = this.#area;
    return stage;
  }

  /** Synchronise both cameras. @param {HTMLElement} half the half that the user turned */
  #follow(half) {
    const [stage, other] = half === this.halves[0] ? [this.stage, this.other] : [this.other, this.stage];
    if (!this.beside || !other || !stage?.dragged) return;
    other.view = undefined;
    other.camera.position.copy(stage.camera.position);
    other.controls.target.copy(stage.controls.target);
    other.controls.update();
  }

  /** @param {unknown} error */
  #fail(error) {
    if (this.element.querySelector(".message")) return;
    console.warn(error);
    const message = made("message empty");
    message.setAttribute("role", "alert");
    message.textContent =
      "This browser cannot show 3D (WebGL 2 is not available). Turn on hardware acceleration in its settings, or " +
      "open the studio in another browser.";
    this.element.append(message);
  }

  #colour() {
    document.documentElement.classList.toggle("dark", this.theme.dark);
    for (const stage of [...this.kept.values(), this.other]) if (stage) stage.dark = this.theme.dark;
    this.stale();
  }

  /** Whether the picture may soon change again; if nothing more does, another is drawn at rest. */
  #moves() {
    const rests = this.#rests;
    this.#rests = false;
    clearTimeout(this.#resting);
    if (rests || !this.stage.software) return this.player.playing;
    if (!this.player.playing) {
      this.#resting = setTimeout(() => {
        this.#rests = true;
        this.stale();
      }, REST_MS);
    }
    return true;
  }

  #draw() {
    if (!this.stage || !this.motion || this.covered) return;
    const moves = this.#moves();
    this.stage.show(this.player.time, this.ghosts);
    this.stage.render(moves, this.pictures.late);
    if (this.beside) {
      this.other.show(this.player.time, this.ghosts);
      this.other.render(moves, this.pictures.late);
    }
    this.dispatchEvent(new Event("draw"));
  }
}

/** @param {string} name */
function made(name) {
  return Object.assign(document.createElement("div"), { className: name });
}

/** @param {any} one @param {any} other */
function longer(one, other) {
  return other && other.end - other.start > one.end - one.start ? other : one;
}

