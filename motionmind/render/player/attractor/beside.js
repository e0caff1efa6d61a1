/** Beside the body, the attractor that its movement follows: it can be turned, and shows where the movement is. */

import "motionmind/main";
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  Line,
  LineBasicMaterial,
  PerspectiveCamera,
  Points,
  Scene,
  ShaderMaterial,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/OrbitControls";
import { PAPERS } from "motionmind/figure";
import { orbit } from "motionmind/keys";
import { MOMENT } from "motionmind/motion";

const FIELD = 26; // degrees from the picture's lower edge to its upper one
const AIR = 1.1; // by how much the picture is larger than the attractor at first
const AWAY = 6; // attractor's radii from it to the viewer
const LIGHTER = 0.4; // share of white in both trajectories' colours on dark paper
const SHEETS = [150, 144, 138];
const $ = (id) => document.getElementById(id);

/** A variation on its attractor, in the space [x, y, z] of the picture, where the attractor's radius is 1. */
class Attractor {
  /**
   * @param {object} data what README.md describes
   * @param {Player} player
   * @param {Theme} theme
   */
  constructor(data, player, theme) {
    this.player = player;
    this.every = data.every;
    this.order = data.order;
    this.jumps = new Set(data.jumps);
    this.times = data.frames.map((frame) => player.motion.times[frame]);
    this.sites = numbers(data.sites);
    this.other = numbers(data.other);
    const sheets = new BufferAttribute(numbers(data.sheets), 3);
    const cells = new Uint16Array(decoded(data.cells));
    this.cells = this.order.reduce((found, posture) => found.set(posture, []), new Map());
    cells.forEach((posture, i) => this.cells.get(posture)?.push(i));

    $("flow").textContent = data.flow;

    const [piece, other] = [new Color(), new Color()];
    const behind = new BufferAttribute(this.other, 3);
    this.cell = dots(sheets, other, 2.6, 0.55);
    this.past = line(behind, other, 1);
    this.head = dots(new BufferAttribute(new Float32Array(3), 3), other, 11, 1);
    this.site = dots(new BufferAttribute(new Float32Array(3), 3), piece, 13, 1);
    this.scene = new Scene().add(
      dots(sheets, inked(new Color(), SHEETS), 1.4, 0.42),
      this.cell,
      line(behind, other, 0.3),
      line(new BufferAttribute(numbers(data.piece), 3), piece, 0.85),
      dots(new BufferAttribute(this.sites, 3), piece, 5, 1),
      this.past,
      this.site,
      this.head,
    );
    this.renderer = new WebGLRenderer({ canvas: $("space"), antialias: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.camera = new PerspectiveCamera(FIELD, 1, 0.01, 100);
    this.camera.position.set(0, 0, AWAY);
    this.half = [0, 1].map((i) => sheets.array.reduce((most, value, at) => (at % 3 === i ? Math.max(most, Math.abs(value)) : most), 0));
    this.controls = new OrbitControls(this.camera, $("space"));
    this.controls.addEventListener("change", () => this.#ask());
    player.addEventListener("change", () => this.follow());
    const colour = () => {
      const { paper } = theme.dark ? PAPERS.dark : PAPERS.light;
      this.renderer.setClearColor(new Color().setRGB(...paper, SRGBColorSpace));
      for (const [name, ink] of Object.entries({ piece, other })) {
        const colour = data.colours[name].map((value) => (theme.dark ? value + LIGHTER * (255 - value) : value));
        inked(ink, colour);
        $("attractor").style.setProperty(`--${name}`, `rgb(${colour.join()})`);
      }
      this.#ask();
    };
    theme.addEventListener("change", colour);
    colour();
    new ResizeObserver(() => this.#resize()).observe($("room"));
    $("attractor").addEventListener("keydown", (event) => {
      if (orbit(event, this.controls)) event.stopPropagation(); // or the body would turn too
    });
    this.follow();
  }

  /** The point of the variation that was last reached, and how far the movement has come to the next one, 0 to 1. */
  get place() {
    const { times } = this;
    let low = 0;
    let high = times.length;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= this.player.time + MOMENT) low = middle;
      else high = middle;
    }
    const step = times[low + 1] - times[low];
    return [low, step > 0 ? Math.min(Math.max((this.player.time - times[low]) / step, 0), 1) : 0];
  }

  /** The posture of the piece that was last reached. */
  get posture() {
    return this.order[this.place[0]];
  }

  /** Show where the player is. */
  follow() {
    const [n, share] = this.place;
    const posture = this.order[n];
    const along = (n + share) * this.every;
    const before = Math.floor(along);
    const after = Math.min(before + 1, this.other.length / 3 - 1);
    this.past.geometry.setDrawRange(0, before + 1);
    this.head.geometry.attributes.position.array.set(
      [0, 1, 2].map((i) => {
        const [from, to] = [this.other[before * 3 + i], this.other[after * 3 + i]];
        return from + (along - before) * (to - from);
      }),
    );
    this.head.geometry.attributes.position.needsUpdate = true;
    if (posture !== this.shown) {
      this.shown = posture;
      this.cell.geometry.setIndex(this.cells.get(posture));
      this.site.geometry.attributes.position.array.set(this.sites.subarray(posture * 3, posture * 3 + 3));
      this.site.geometry.attributes.position.needsUpdate = true;
      $("site").textContent = posture;
      $("site").hidden = false;
    }
    const jump = this.jumps.has(n) ? ` · jumped from ${this.order[n - 1]}` : "";
    $("reading").textContent = `posture ${posture}, at ${n} of ${this.order.length - 1}${jump}`;
    this.#ask();
  }

  /** Have the next picture drawn. */
  #ask() {
    this.asked ||= requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.asked = 0;
    this.renderer.render(this.scene, this.camera);
    const { clientWidth: width, clientHeight: height } = $("room");
    const seen = new Vector3().fromArray(this.site.geometry.attributes.position.array).project(this.camera);
    $("site").style.left = `${(0.5 + 0.5 * seen.x) * width}px`;
    $("site").style.top = `${(0.5 - 0.5 * seen.y) * height}px`;
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = $("room");
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    const needed = AIR * Math.max(this.half[1], (this.half[0] * height) / width);
    this.camera.zoom = (AWAY * Math.tan((FIELD * Math.PI) / 360)) / needed;
    this.camera.updateProjectionMatrix();
    this.#ask();
  }
}

/** Make a colour that of [red, green, blue], 0 to 255; returns it. */
function inked(colour, channels) {
  return colour.setRGB(...channels.map((value) => value / 255), SRGBColorSpace);
}

/** Round dots, so many CSS pixels wide. */
function dots(places, colour, size, opacity) {
  const material = new ShaderMaterial({
    uniforms: {
      size: { value: size * Math.min(window.devicePixelRatio, 2) },
      colour: { value: colour },
      opacity: { value: opacity },
    },
    vertexShader: /* glsl */ `
      uniform float size;
      void main() {
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
        gl_PointSize = size;
      }`,
    fragmentShader: /* glsl */ `
      uniform vec3 colour;
      uniform float opacity;
      void main() {
        if (length(gl_PointCoord - 0.5) > 0.5) discard;
        gl_FragColor = vec4(colour, opacity);
        #include <colorspace_fragment>
      }`,
    transparent: true,
    depthTest: false,
    depthWrite: false,
  });
  const found = new Points(new BufferGeometry().setAttribute("position", places), material);
  found.frustumCulled = false;
  return found;
}

/** A line through places. */
function line(places, colour, opacity) {
  const material = new LineBasicMaterial({ opacity, transparent: true, depthTest: false, depthWrite: false });
  material.color = colour; // the same object, so that it changes with the paper
  const found = new Line(new BufferGeometry().setAttribute("position", places), material);
  found.frustumCulled = false;
  return found;
}

function decoded(base64) {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
}

function numbers(base64) {
  return new Float32Array(decoded(base64));
}

if (window.motionmind) {
  const data = JSON.parse($("data").textContent).beside;
  window.motionmind.attractor = new Attractor(data, window.motionmind.player, window.motionmind.theme);
} else {
  $("attractor").hidden = true; // the page says why nothing can be drawn
}
