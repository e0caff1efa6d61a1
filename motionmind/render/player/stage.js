/** Where the body is seen: floor, shadow, ghosts, body; the camera and what it may do. */

import {
  BufferGeometry,
  Color,
  Group,
  LineSegments,
  Mesh,
  PerspectiveCamera,
  RingGeometry,
  Scene,
  ShaderMaterial,
  SRGBColorSpace,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/OrbitControls";
import { COARSE, Figures, FINE, Marks, paperUniforms, PAPERS } from "motionmind/figure";
import { corners, edge } from "motionmind/lines";
import { Trails } from "motionmind/trails";

const FIELD = 26; // degrees from the picture's lower edge to its upper one
const SHARPEST = 2; // device pixels to a CSS pixel, at most
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i; // what browsers call drawing without a GPU
const [SLOW, FAST] = [40, 22]; // milliseconds that a picture is late, which make moving ones coarser, or finer again,
const [COARSER, COARSEST] = [0.8, 0.5]; // by this factor, down to so many pixels to a CSS pixel,
const COUNT = 6; // as a mean of so many
const SAMPLES = 150; // postures, at most, to find a path's extent, besides the ones that reach farthest
const MARGIN = 0.12; // metres round the ends of limbs that a body 1.70 m tall takes up, and some air
const PIECES = 16; // of a line of the floor's grid, along which it fades
const GHOSTS = 0.34; // strength of A and B
const WAYPOINTS = 8; // ghosts more than those, at most
const ONION = [0.44, 0.3, 0.18]; // strength of the frames before and after, from the nearest on

/** Directions to look from. At rest the body faces +z, the audience; its left is +x. */
const VIEWS = {
  front: [0, 0.08, 1],
  side: [-1, 0.08, 0], // from stage right: the audience is to the right
  top: [0, 1, 0.0001], // the audience is below
  quarter: [-0.62, 0.34, 1],
};

export class Stage {
  #plain = 1; // share of the pixels along each side of what moves, without a GPU
  #late = []; // milliseconds that the last moving pictures were late
  #area; // of the floor, [width, depth] in metres

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Motion} motion
   * @param {Body} body
   * @param {object} colours {given, inserted, bridged, ink}
   * @param {function} onChange called when the picture must be drawn again
   */
  constructor(canvas, motion, body, colours, onChange) {
    this.canvas = canvas;
    this.software = drawnInSoftware();
    this.renderer = new WebGLRenderer({ canvas, antialias: !this.software && window.devicePixelRatio < SHARPEST });
    this.renderer.autoClear = false;
    this.papers = paperUniforms();
    this.dark = false;
    this.camera = new PerspectiveCamera(FIELD, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.5 * Math.PI; // not under the floor
    this.take(motion, body, colours);
    this.dragged = false;
    this.controls.addEventListener("start", () => {
      this.view = undefined;
      this.dragged = true;
    });
    this.controls.addEventListener("end", () => {
      this.dragged = false;
      onChange();
    });
    this.controls.addEventListener("change", onChange);
    this.look("quarter");
    new ResizeObserver(() => {
      this.#resize();
      onChange();
    }).observe(canvas.parentElement);
  }

  /** Show another movement, from where the camera is: `look` brings all of it into the picture. Arguments as at first. */
  take(motion, body, colours) {
    const same = this.body === body && this.colours === colours;
    Object.assign(this, { motion, body, colours, ghostsShown: "" });
    if (!same) {
      for (const layer of this.layers ?? []) {
        layer.traverse((thing) => [thing.geometry, thing.material].forEach((part) => part?.dispose()));
      }
      this.embody();
    }
    this.trails?.forget(); // of a movement that may have grown
    this.#measure();
    this.floor?.traverse((thing) => [thing.geometry, thing.material].forEach((part) => part?.dispose()));
    this.layers[0].clear();
    if (this.grounded) {
      this.floor = floor(this.middle, this.reach, body.size, this.papers);
      this.layers[0].add(this.floor, this.figure.shadows);
    }
    this.area = this.#area;
    Object.assign(this.camera, { near: 0.01 * this.reach, far: 100 * this.reach });
    this.camera.updateProjectionMatrix();
    this.controls.minDistance = 0.2 * this.reach;
    this.controls.maxDistance = 30 * this.reach;
  }

  /** Draw the edge of an area of the floor around the origin, [width, depth] in metres; undefined or null for none. */
  set area(area) {
    this.#area = area;
    this.edge?.removeFromParent();
    for (const part of [this.edge?.geometry, this.edge?.material]) part?.dispose();
    this.edge = area ? edge(area, this.body.size) : undefined;
    if (this.edge) this.layers[0].add(this.edge);
  }

  /** Whether the paper is dark. */
  set dark(value) {
    const colours = value ? PAPERS.dark : PAPERS.light;
    for (const [name, colour] of Object.entries(colours)) this.papers[name].value.fromArray(colour);
    this.renderer.setClearColor(new Color().setRGB(...colours.paper, SRGBColorSpace));
  }

  /** Look from "front", "side", "top" or "quarter", so that the whole path is seen, from the top with all of the area. */
  look(view) {
    this.view = view;
    const around = view === "top" && this.#area ? corners(this.#area).map(([x, z]) => new Vector3(x, 0, z)) : [];
    const towards = new Vector3(...VIEWS[view]).normalize();
    const right = new Vector3(0, 1, 0).cross(towards).normalize();
    const up = towards.clone().cross(right);
    const tall = Math.tan((FIELD * Math.PI) / 360);
    const wide = tall * this.camera.aspect;
    const [x, y, z] = [right, up, towards].map((axis) => [...this.cloud, ...around].map((place) => place.dot(axis)));
    const middle = [x, y].map((values) => 0.5 * (least(values) + most(values)));
    const margin = MARGIN * this.body.size;
    const far = most(
      z.map((depth, i) => {
        const [across, above] = [Math.abs(x[i] - middle[0]) + margin, Math.abs(y[i] - middle[1]) + margin];
        return depth + margin + Math.max(across / wide, above / tall);
      }),
    );
    const depth = 0.5 * (least(z) + most(z));
    this.controls.target
      .set(0, 0, 0)
      .addScaledVector(right, middle[0])
      .addScaledVector(up, middle[1])
      .addScaledVector(towards, depth);
    this.camera.position.copy(this.controls.target).addScaledVector(towards, far - depth);
    this.controls.update();
  }

  /**
   * Put the body where it is at `time`.
   * @param {object} ghosts {ends: whether the A and B of the insertion that goes on are shown, onion: how many frames
   *   the ghosts before and after are apart, 0 for none, trails: whose paths are drawn, waypoints: times of more ghosts}
   */
  show(time, { ends, onion, trails = [], waypoints = [] }) {
    this.#showGhosts(time, ends, onion, waypoints);
    this.#showTrails(time, trails);
    this.pose(time);
    this.figure.set(0, this.#palette(time));
    this.figure.show(1);
    this.figure.uniforms.middle.value.fromArray(this.root);
    this.marks.show(this.motion.bridgedAt(time));
  }

  /** Draw it; `moving` says that the next picture is to follow at once, `late` by how many milliseconds this one does. */
  render(moving, late) {
    this.#sharpen(moving || this.dragged, late);
    this.#draw();
  }

  /** Whether a film is made, whose pictures keep their shape, even if the page's becomes another. */
  set filming(value) {
    this.fixed = value;
    if (!value) this.#resize();
  }

  /** Draw the body at `time` onto a canvas of the same shape; a GPU smooths it from twice as many pixels each way. */
  shoot(pen, time, ghosts) {
    const { width, height } = pen.canvas;
    this.show(time, ghosts);
    const ratio = ((this.software ? 1 : 2) * width) / this.renderer.getSize(new Vector2()).x;
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    this.#draw();
    pen.drawImage(this.canvas, 0, 0, width, height);
  }

  #draw() {
    this.renderer.clear();
    for (const layer of this.layers) {
      this.renderer.clearDepth(); // ghosts are behind the body, wherever they are, and hide nothing of it
      this.renderer.render(layer, this.camera);
    }
  }

  /** Make what draws the body, its ghosts and its bridges. */
  embody() {
    const { body, colours, motion } = this;
    this.rotations = new Float64Array(motion.joints.length * 4);
    this.root = new Float64Array(3);
    this.figure = new Figures(body, 1, FINE, colours, this.papers);
    this.ghosts = new Figures(body, WAYPOINTS + 2 + 2 * ONION.length, COARSE, colours, this.papers);
    this.marks = new Marks(body, colours.bridged, this.figure.uniforms);
    this.trails = undefined;
    this.ghosts.uniforms.middle = this.figure.uniforms.middle;
    this.figure.pixel = this.ghosts.pixel = this.pixel ?? 0;
    this.layers = [new Scene(), new Scene(), new Scene()];
    this.layers[1].add(this.ghosts.group);
    this.layers[2].add(this.figure.group, this.marks.group);
  }

  /** Trails are made when they are first asked for. */
  #showTrails(time, parts) {
    if (!this.trails && parts.some((part) => this.body.trails[part]?.length > 0)) {
      this.trails = new Trails(this.body, this.colours, this.figure.uniforms);
      this.layers[2].add(this.trails.mesh);
    }
    this.trails?.show(this.motion, time, parts);
  }

  #showGhosts(time, ends, onion, waypoints) {
    const { times } = this.motion;
    const ghosts = waypoints.slice(0, WAYPOINTS).map((at) => [at, GHOSTS]);
    const insertion = ends && this.motion.insertionAt(time);
    if (insertion) for (const at of this.motion.ends(insertion)) ghosts.push([at, GHOSTS]);
    if (onion > 0) {
      const frame = this.motion.frameAt(time);
      ONION.forEach((strength, i) => {
        for (const at of [frame - (i + 1) * onion, frame + (i + 1) * onion]) {
          if (times[at] !== undefined) ghosts.push([times[at], strength]);
        }
      });
    }
    const shown = JSON.stringify(ghosts);
    if (shown === this.ghostsShown) return;
    this.ghostsShown = shown;
    ghosts.forEach(([at, strength], index) => {
      this.pose(at);
      this.ghosts.set(index, this.#palette(at), strength);
    });
    this.ghosts.show(ghosts.length);
  }

  pose(time) {
    this.motion.sample(time, this.rotations, this.root);
    this.body.pose(this.rotations, this.root);
  }

  /** Pose the body as it is in the frames that show how far the path leads, one after another. */
  *poses() {
    const step = Math.max(1, Math.ceil(this.motion.length / SAMPLES));
    const frames = new Set(this.motion.farthest);
    for (let frame = 0; frame < this.motion.length; frame += step) frames.add(frame);
    for (const frame of frames) {
      this.pose(this.motion.times[frame]);
      yield this.body;
    }
  }

  #palette(time) {
    return this.motion.insertedAt(time) ? "inserted" : "given";
  }

  /** Find where the path leads: `cloud`, places in the body in many postures; its `middle`, its `reach` from there. */
  #measure() {
    this.cloud = [];
    for (const body of this.poses()) {
      const [cones, balls] = [new Array(body.cones.length * 8), new Array(body.balls.length * 12)];
      body.writeCones(cones);
      body.writeBalls(balls);
      for (let i = 0; i < cones.length; i += 4) this.cloud.push(new Vector3().fromArray(cones, i));
      for (let i = 0; i < balls.length; i += 12) {
        const centre = new Vector3().fromArray(balls, i);
        for (let axis = 3; axis < 12; axis += 3) {
          const half = new Vector3().fromArray(balls, i + axis);
          this.cloud.push(centre.clone().add(half), centre.clone().sub(half));
        }
      }
    }
    const heights = this.cloud.map((place) => place.y);
    const [low, high] = [least(heights), most(heights)];
    // A recording's floor may be so far off that it would leave no room for the body.
    this.grounded = Math.abs(low) < Math.max(high - low, this.body.size);
    if (this.grounded) this.cloud = this.cloud.concat(this.cloud.map((place) => new Vector3(place.x, 0, place.z)));
    this.middle = new Vector3();
    for (const place of this.cloud) this.middle.addScaledVector(place, 1 / this.cloud.length);
    this.reach = this.body.size + most(this.cloud.map((place) => place.distanceTo(this.middle)));
  }

  /**
   * Without a GPU to smooth all edges takes longer than all else: there what moves is drawn plainly, and more so if pictures
   * still come slowly; what rests is drawn finely.
   */
  #sharpen(moving, late) {
    const screen = window.devicePixelRatio; // below 1 where the page is zoomed out: more would not be seen
    if (moving) this.#hurry(late);
    const ratio = Math.min(this.software ? (moving ? Math.min(screen, 1) * this.#plain : 2 * screen) : screen, SHARPEST);
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
  }

  /** Find how plainly to draw what moves, from how late the last pictures came. */
  #hurry(late) {
    this.#late.push(late);
    if (this.#late.length < COUNT) return;
    const mean = this.#late.reduce((sum, one) => sum + one) / COUNT;
    this.#late = [];
    if (mean > SLOW) this.#plain = Math.max(this.#plain * COARSER, COARSEST);
    else if (mean < FAST) this.#plain = Math.min(this.#plain / COARSER, 1);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentElement;
    if (width === 0 || height === 0 || this.fixed) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.pixel = (2 * Math.tan((FIELD * Math.PI) / 360)) / height;
    this.figure.pixel = this.ghosts.pixel = this.pixel;
    if (this.view) this.look(this.view);
  }
}

/** Whether the browser has no GPU to draw with, as far as it tells. */
function drawnInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const told = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name);
}

/** A disc with a grid of metres (or of a tenth, or of ten, as the body's size is) that fades into the paper. */
function floor(middle, reach, size, papers) {
  const radius = 2.4 * reach + 2 * size;
  const step = 10 ** Math.round(Math.log10(size));
  const disc = new RingGeometry(0, radius, 48, 10).rotateX(-0.5 * Math.PI).translate(middle.x, 0, middle.z);
  const lines = [];
  for (const [along, across] of [
    ["x", "z"],
    ["z", "x"],
  ]) {
    const reached = Math.floor((middle[across] + radius) / step);
    for (let i = Math.ceil((middle[across] - radius) / step); i <= reached; i++) {
      const half = Math.sqrt(radius ** 2 - (i * step - middle[across]) ** 2);
      const places = Array.from({ length: PIECES + 1 }, (_, k) => {
        const place = new Vector3();
        place[along] = middle[along] + half * ((2 * k) / PIECES - 1);
        place[across] = i * step;
        return place;
      });
      for (let k = 0; k < PIECES; k++) lines.push(places[k], places[k + 1]);
    }
  }
  const grid = new BufferGeometry().setFromPoints(lines);
  const ground = new Group().add(
    new Mesh(disc, fading(middle, radius, 0.35, papers)),
    new LineSegments(grid, fading(middle, radius, 1, papers)),
  );
  ground.renderOrder = -1; // before the shadow
  return ground;
}

/** A material with a `share` of the contrast that the grid has with paper, the less the nearer to the edge of the floor. */
function fading(middle, radius, share, papers) {
  return new ShaderMaterial({
    uniforms: {
      middle: { value: middle },
      radius: { value: radius },
      share: { value: share },
      ...papers,
    },
    vertexShader: /* glsl */ `
      uniform vec3 middle;
      uniform float radius;
      varying float vFade;
      void main() {
        vFade = 1.0 - smoothstep(0.35, 1.0, distance(position.xz, middle.xz) / radius);
        gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: /* glsl */ `
      uniform vec3 paper, grid;
      uniform float share;
      varying float vFade;
      void main() {
        gl_FragColor = vec4(mix(paper, grid, vFade * share), 1.0);
      }`,
    depthTest: false,
    depthWrite: false,
  });
}

function least(values) {
  return values.reduce((a, b) => Math.min(a, b));
}

function most(values) {
  return values.reduce((a, b) => Math.max(a, b));
}
