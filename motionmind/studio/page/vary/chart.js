/** Draw the attractor's map, and convert points to pixels and back. Nothing here handles events. */

const MARGIN_PX = 14; // around the attractor
const CROSS = [
  [1, 0],
  [-1, 0],
  [0, 1],
  [0, -1],
];
const MIN_DOT_DISTANCE_PX = 5; // closer postures have no dots

/** Decode points: float32 [N][3] in base64. @param {string} text */
export function points(text) {
  return new Float32Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}

/** The projection of an attractor's points to pixels. */
export class Chart {
  /** @param {Float32Array} all points of the attractor [N * 3] @param {number[]} axes to the right, up, towards */
  constructor(all, [across, up]) {
    this.all = all;
    this.across = across;
    this.up = up;
    this.bounds = [across, up].map((axis) => {
      let [low, high] = [Infinity, -Infinity];
      for (let i = axis; i < all.length; i += 3) [low, high] = [Math.min(low, all[i]), Math.max(high, all[i])];
      return [low, high];
    });
    this.width = 300;
    this.height = 240;
    this.scale = 1;
    this.x0 = 0;
    this.y0 = 0;
    this.resize(this.width, this.height);
  }

  /** @param {number} width @param {number} height */
  resize(width, height) {
    const [[left, right], [low, high]] = this.bounds;
    this.scale = Math.min((width - 2 * MARGIN_PX) / (right - left), (height - 2 * MARGIN_PX) / (high - low));
    this.x0 = width / 2 - (this.scale * (left + right)) / 2;
    this.y0 = height / 2 + (this.scale * (low + high)) / 2;
    this.width = width;
    this.height = height;
  }

  /** Pixels of the point at `i` of some points. @param {ArrayLike<number>} some @param {number} i @returns {[number, number]} */
  at(some, i) {
    return [this.x0 + this.scale * some[i * 3 + this.across], this.y0 - this.scale * some[i * 3 + this.up]];
  }

  /** The index of the attractor's point nearest to a pixel. @param {number} x @param {number} y */
  nearest(x, y) {
    let [best, least] = [0, Infinity];
    for (let i = 0; i * 3 < this.all.length; i++) {
      const [px, py] = this.at(this.all, i);
      const far = (px - x) ** 2 + (py - y) ** 2;
      if (far < least) [best, least] = [i, far];
    }
    return best;
  }

  /** The attractor's point at an index, modulo their number. @param {number} i @returns {[number, number, number]} */
  point(i) {
    const count = this.all.length / 3;
    const at = (((i % count) + count) % count) * 3;
    return [this.all[at], this.all[at + 1], this.all[at + 2]];
  }
}

/**
 * @typedef {{sheets: string, piece: string, other: string, paper: string, ink: string}} Inks
 * @typedef {{trail: Float32Array, other: Float32Array, every: number, jumps: number[]}} Shown
 */

/**
 * Draw the map without the moving head.
 * @param {CanvasRenderingContext2D} pen @param {Chart} chart @param {Inks} inks @param {Shown} shown
 */
export function draw(pen, chart, inks, { trail, other, every, jumps }) {
  pen.clearRect(0, 0, chart.width, chart.height);
  pen.globalAlpha = 0.5;
  pen.fillStyle = inks.sheets;
  for (let i = 0; i * 3 < chart.all.length; i++) {
    const [x, y] = chart.at(chart.all, i);
    pen.fillRect(x, y, 1, 1);
  }
  pen.globalAlpha = 0.75;
  line(pen, chart, trail, inks.piece, 2);
  pen.globalAlpha = 1;
  line(pen, chart, other, inks.other, 1.2);
  dots(pen, chart, trail, every, inks);
  pen.strokeStyle = inks.other;
  pen.fillStyle = inks.paper;
  for (const n of jumps) {
    if (n * every * 3 >= other.length) break;
    diamond(pen, chart.at(other, n * every), 3.5);
  }
  if (trail.length) start(pen, chart.at(trail, 0), inks);
}

/**
 * Draw the head: where the variation is, among its postures.
 * @param {CanvasRenderingContext2D} pen @param {Chart} chart @param {Inks} inks @param {Shown} shown @param {number} place
 */
export function drawHead(pen, chart, inks, { other, every }, place) {
  if (!other.length) return;
  const [x, y] = chart.at(other, Math.min(Math.round(place * every), other.length / 3 - 1));
  pen.fillStyle = inks.other;
  disc(pen, x, y, 5.5);
  pen.strokeStyle = inks.paper;
  pen.lineWidth = 1.5;
  pen.stroke();
}

/** @param {CanvasRenderingContext2D} pen @param {Chart} chart @param {Float32Array} some */
function line(pen, chart, some, ink, width) {
  pen.beginPath();
  for (let i = 0; i * 3 < some.length; i++) pen.lineTo(...chart.at(some, i));
  pen.strokeStyle = ink;
  pen.lineWidth = width;
  pen.stroke();
}

/** Draw the piece's postures, where there is room. */
function dots(pen, chart, trail, every, inks) {
  pen.fillStyle = inks.piece;
  let [lastX, lastY] = [-Infinity, -Infinity];
  for (let i = 0; i * 3 < trail.length; i += every) {
    const [x, y] = chart.at(trail, i);
    if (Math.hypot(x - lastX, y - lastY) < MIN_DOT_DISTANCE_PX) continue;
    [lastX, lastY] = [x, y];
    disc(pen, x, y, 2.4);
  }
}

function disc(pen, x, y, radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}

/** Mark where the variation leaves the order: a diamond, which differs from the dots even without colour. */
function diamond(pen, [x, y], radius) {
  pen.beginPath();
  pen.moveTo(x, y - radius);
  pen.lineTo(x + radius, y);
  pen.lineTo(x, y + radius);
  pen.lineTo(x - radius, y);
  pen.closePath();
  pen.lineWidth = 1.4;
  pen.fill();
  pen.stroke();
}

/** Draw the handle of the start: a ring with a cross. */
function start(pen, [x, y], inks) {
  pen.lineWidth = 4;
  pen.strokeStyle = inks.paper;
  ring(pen, x, y);
  pen.lineWidth = 2;
  pen.strokeStyle = inks.ink;
  ring(pen, x, y);
}

function ring(pen, x, y) {
  pen.beginPath();
  pen.arc(x, y, 8, 0, 2 * Math.PI);
  for (const [dx, dy] of CROSS) {
    pen.moveTo(x + 4 * dx, y + 4 * dy);
    pen.lineTo(x + 12 * dx, y + 12 * dy);
  }
  pen.stroke();
}
