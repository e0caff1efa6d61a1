/** Several dancers on one stage: their movements on one clock, their bodies before one camera, their names. */

import { Body } from "motionmind/body";
import { Figures, FINE, COARSE, Marks } from "motionmind/figure";
import { MOMENT, Motion, decoded } from "motionmind/motion";
import { Stage } from "motionmind/stage";
import { Group, Scene, Vector3 } from "three";

const FEW = 4; // dancers who are drawn finely
const SAMPLES = 600; // postures of all dancers together, at most, to find their extent
const OVERHEAD = 1.05; // metres from the pelvis of a body 1.70 m tall to its name
const LETTERS = 0.026; // height of names in a film, as a share of the picture's

/** A dancer: a piece that others may dance too, at a place of its own, turned, and later. */
class Dancer {
  /** @param {object} data what README.md describes  @param {Motion[]} pieces  @param {Body[]} bodies */
  constructor(data, pieces, bodies) {
    Object.assign(this, data);
    this.piece = pieces[data.piece];
    this.body = bodies[data.piece];
    this.turn = [Math.sin(0.5 * data.facing), Math.cos(0.5 * data.facing)]; // y and w of a rotation about the vertical
    this.shown = true;
  }

  /** The piece's own time at a time of the ensemble, between its start and its end; it waits on ways. */
  own(time) {
    let own = Math.max(time - this.entry, 0);
    for (const [from, to] of this.ways) {
      const start = Math.max(from, this.entry);
      if (time > start && to > start) own -= Math.min(time, to) - start;
    }
    return Math.min(own + this.piece.start, this.piece.end);
  }

  /** The time of the ensemble at a time of the piece. */
  clock(own) {
    let time = own - this.piece.start + this.entry;
    for (const [from, to] of this.ways) {
      const start = Math.max(from, this.entry);
      if (time > start) time += Math.max(to - start, 0);
    }
    return time;
  }

  /** Put the posture at `time` into `rotations` and `root`; before its entry and after its end a dancer stands still. */
  sample(time, rotations, root) {
    const { piece, place, turn } = this;
    piece.sample(this.own(time), rotations, root);
    const [s, c] = turn;
    const [x, y, z, w] = rotations;
    Object.assign(rotations, [c * x + s * z, c * y + s * w, c * z - s * x, c * w - s * y]);
    const [sine, cosine] = [2 * s * c, c * c - s * s];
    const [dx, dz] = [root[0] - piece.root[0], root[2] - piece.root[2]];
    root[0] = place[0] + cosine * dx + sine * dz;
    root[2] = place[1] - sine * dx + cosine * dz;
    for (const [from, to, x, z] of this.ways) {
      const share = Math.min(Math.max((time - from) / (to - from), 0), 1);
      const eased = share * share * (3 - 2 * share);
      root[0] += eased * x;
      root[2] += eased * z;
    }
  }

  /** Pose the dancer's body, which others may share. */
  pose(time, rotations, root) {
    this.sample(time, rotations, root);
    this.body.pose(rotations, root);
  }
}

/** The dancers on one clock, with what the player and the line of time ask of a motion. */
export class Ensemble {
  /** @param {object} data what README.md describes  @param {Motion[]} pieces  @param {Body[]} bodies of the pieces */
  constructor(data, pieces = data.pieces.map((piece) => new Motion(piece)), bodies = bodiesOf(data.pieces)) {
    this.name = data.name;
    this.sound = data.sound && decoded(data.sound); // a sound file, or undefined
    this.dancers = data.dancers.map((dancer) => new Dancer(dancer, pieces, bodies));
    this.body = this.dancers[0].body;
    this.joints = pieces[0].joints;
    this.first = 0;
    this.rate = data.rate; // frames a second
    this.times = Array.from({ length: data.frames }, (_, frame) => frame / data.rate);
    this.insertions = []; // those of the pieces are painted, and not on the line of time
  }

  /** What the legend asks: the insertions of all. */
  get painted() {
    return { insertions: this.dancers.flatMap(({ piece }) => piece.insertions), ends: () => [] };
  }

  get length() {
    return this.times.length;
  }

  get start() {
    return 0;
  }

  get end() {
    return this.times[this.length - 1];
  }

  frameAt(time) {
    return Math.min(Math.max(Math.floor((time + MOMENT) * this.rate), 0), this.length - 1);
  }

  insertionAt() {
    return undefined;
  }

  /** Whether the engine made the posture of a dancer who is shown. */
  insertedAt(time) {
    return this.dancers.some((dancer) => dancer.shown && dancer.piece.insertedAt(dancer.own(time)));
  }

  bridgedAt() {
    return [];
  }
}

/** The stage of an ensemble. */
export class GroupStage extends Stage {
  embody() {
    const { dancers } = this.motion;
    const bodies = [...new Set(dancers.map(({ body }) => body))];
    const mesh = dancers.length > FEW ? COARSE : FINE;
    const longest = Math.max(...bodies.map(({ parents }) => parents.length));
    this.rotations = new Float64Array(longest * 4);
    this.root = new Float64Array(3);
    this.casts = new Map(bodies.map((body) => [body, new Figures(body, dancers.length, mesh, this.colours, this.papers)]));
    this.bridges = new Map(dancers.filter(bridging).map((dancer) => [dancer, marks(dancer, this)]));
    this.figure = together([...this.casts.values()]);
    this.ghosts = { pixel: 0 };
    this.layers = [new Scene(), new Scene()];
    this.layers[1].add(this.figure.group, ...[...this.bridges.values()].map(({ group }) => group));
    this.heads = dancers.map(() => new Vector3());
    for (const old of this.labels ?? []) old.remove();
    this.labels = dancers.map((dancer) => label(dancer, this.canvas.parentElement));
  }

  /** Put all dancers where they are at `time`. There are no ghosts of groups. */
  show(time) {
    const counts = new Map([...this.casts.keys()].map((body) => [body, 0]));
    const middle = new Vector3();
    const dancers = this.motion.dancers.filter(({ shown }) => shown);
    this.motion.dancers.forEach((dancer, i) => {
      this.bridges.get(dancer)?.show([]);
      if (!dancer.shown) return;
      const { body } = dancer;
      const own = dancer.own(time);
      dancer.pose(time, this.rotations, this.root);
      this.casts.get(body).set(counts.get(body), dancer.piece.insertedAt(own) ? "inserted" : i);
      counts.set(body, counts.get(body) + 1);
      this.bridges.get(dancer)?.show(dancer.piece.bridgedAt(own));
      const [x, y, z] = this.root;
      middle.add(this.heads[i].set(x, y, z).divideScalar(dancers.length));
      this.heads[i].set(x, y + OVERHEAD * body.size, z);
    });
    for (const [body, count] of counts) this.casts.get(body).show(count);
    for (const { uniforms } of this.casts.values()) {
      uniforms.middle.value.copy(middle);
      uniforms.depth.value = 2 * this.reach;
    }
  }

  render(moving, late) {
    super.render(moving, late);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.motion.dancers.forEach((dancer, i) => {
      const [x, y, depth] = this.#onCanvas(this.heads[i], width, height);
      this.labels[i].hidden = !dancer.shown;
      this.labels[i].style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -100%)`;
      this.labels[i].style.zIndex = Math.round(1000 * (1 - depth)); // the nearer in front
    });
  }

  /** Draw all dancers and their names onto a canvas. */
  shoot(pen, time, ghosts) {
    super.shoot(pen, time, ghosts);
    const { width, height } = pen.canvas;
    Object.assign(pen, { font: `600 ${Math.round(LETTERS * height)}px sans-serif`, textAlign: "center", lineWidth: 3 });
    this.motion.dancers.forEach(({ name, colour, shown }, i) => {
      if (!shown) return;
      const [x, y] = this.#onCanvas(this.heads[i], width, height);
      Object.assign(pen, { strokeStyle: "white", fillStyle: `rgb(${colour.join()})` });
      pen.strokeText(name, x, y);
      pen.fillText(name, x, y);
    });
  }

  *poses() {
    const { dancers } = this.motion;
    const each = Math.max(2, Math.floor(SAMPLES / dancers.length));
    for (const dancer of dancers) {
      const { times, farthest, length } = dancer.piece;
      const step = Math.max(1, Math.ceil(length / each));
      const frames = new Set(farthest);
      for (let frame = 0; frame < length; frame += step) frames.add(frame);
      const moments = [...frames].map((frame) => dancer.clock(times[frame]));
      for (const time of moments.concat(dancer.ways.flatMap(([from, to]) => [from, to]))) {
        dancer.pose(time, this.rotations, this.root);
        yield dancer.body;
      }
    }
  }

  #onCanvas(place, width, height) {
    const seen = place.clone().project(this.camera);
    return [(0.5 + 0.5 * seen.x) * width, (0.5 - 0.5 * seen.y) * height, seen.z];
  }
}

/**
 * Write a button for each dancer, which shows or hides it.
 * @param {HTMLElement} group
 * @param {Ensemble} ensemble
 * @param {function} refresh has the picture drawn again
 */
export function writeDancers(group, ensemble, refresh) {
  for (const dancer of ensemble.dancers) {
    const button = document.createElement("button");
    button.append(swatch(dancer), dancer.name);
    button.setAttribute("aria-pressed", "true");
    button.title = `Show or hide ${dancer.name}`;
    button.addEventListener("click", () => {
      dancer.shown = !dancer.shown;
      button.setAttribute("aria-pressed", String(dancer.shown));
      refresh();
    });
    group.append(button);
  }
  group.hidden = false;
}

/** The bodies of pieces; pieces with equal bodies share one. */
function bodiesOf(pieces) {
  const known = new Map();
  return pieces.map(({ skeleton, body }) => {
    const key = JSON.stringify([skeleton, body]);
    if (!known.has(key)) known.set(key, new Body(skeleton, body));
    return known.get(key);
  });
}

/** Whether a joint of the dancer's moves as no corpus attests. */
function bridging({ piece }) {
  return piece.insertions.some(({ bridged }) => bridged.length > 0);
}

/** The balls that mark a dancer's bridged joints, on a stage. */
function marks({ body }, { colours, casts }) {
  return new Marks(body, colours.bridged, casts.get(body).uniforms);
}

/** Figures of several kinds of bodies, as one. */
function together(figures) {
  return {
    group: new Group().add(...figures.map(({ group }) => group)),
    shadows: new Group().add(...figures.map(({ shadows }) => shadows)),
    uniforms: figures[0].uniforms,
    set pixel(value) {
      for (const one of figures) one.pixel = value;
    },
  };
}

/** A dancer's name over its head. */
function label(dancer, parent) {
  const element = document.createElement("span");
  element.className = "name";
  element.setAttribute("aria-hidden", "true"); // the buttons below name all
  element.append(swatch(dancer), dancer.name);
  parent.append(element);
  return element;
}

function swatch({ colour }) {
  const element = document.createElement("i");
  element.style.background = `rgb(${colour.join()})`;
  return element;
}
