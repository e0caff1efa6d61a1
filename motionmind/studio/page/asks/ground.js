/** From the pointer and the arrow keys to places on the floor, and the few points that a drawn line needs. */

import { Vector3 } from "three";

const FARTHEST_M = 60; // from the camera's target: nearer to the horizon a pixel spans metres
const KEY_STEP_M = 0.05; // for a body of human size; with Shift five times as far
const OFF_LINE_M = 0.04; // of a drawn line, up to which a point is left out

/**
 * The place on the floor under the pointer; null at the sky.
 * @param {PointerEvent} event @param {Element} element covers the view @param {any} stage @returns {[number, number, number] | null}
 */
export function groundUnder(event, element, { camera, controls }) {
  const { left, top, width, height } = element.getBoundingClientRect();
  const [x, y] = [(2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height];
  camera.updateMatrixWorld(); // it may have moved since the last picture
  const ray = new Vector3(x, y, 0.5).unproject(camera).sub(camera.position);
  if (ray.y >= 0) return null;
  const place = ray.multiplyScalar(-camera.position.y / ray.y).add(camera.position);
  return place.distanceTo(controls.target) < FARTHEST_M ? [place.x, 0, place.z] : null;
}

/** By how much a key moves a place on the floor, as the camera sees it; null for other keys. @param {KeyboardEvent} event @param {any} camera @param {number} size of the body @returns {[number, number] | null} */
export function groundStep(event, camera, size) {
  const [right, away] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0];
  if ((!right && !away) || event.ctrlKey || event.metaKey || event.altKey) return null;
  const across = new Vector3(1, 0, 0).applyQuaternion(camera.quaternion).setY(0).normalize();
  const step = KEY_STEP_M * size * (event.shiftKey ? 5 : 1);
  return [step * (right * across.x + away * across.z), step * (right * across.z - away * across.x)];
}

/** Whether the floor is seen steeply enough to draw on it. @param {any} stage */
export function isSteep({ camera, controls }) {
  const towards = camera.position.clone().sub(controls.target);
  return towards.y > 0.6 * towards.length();
}

/**
 * The ends of a line and its points that straight lines between the kept ones would miss, at most `most`.
 * Source: Ramer (1972) and Douglas and Peucker (1973).
 * @template {number[]} P
 * @param {P[]} line @param {number} most @param {number} off metres @returns {P[]}
 */
export function simplified(line, most, off = OFF_LINE_M) {
  const kept = [0, ...between(line, 0, line.length - 1, off), line.length - 1].map((i) => line[i]);
  return kept.length > most ? simplified(line, most, 1.5 * off) : kept;
}

/** @param {number[][]} line @param {number} first @param {number} last @param {number} off @returns {number[]} */
function between(line, first, last, off) {
  let [far, at] = [off, 0];
  for (let i = first + 1; i < last; i++) {
    const distance = distanceTo(line[i], line[first], line[last]);
    if (distance > far) [far, at] = [distance, i];
  }
  return at ? [...between(line, first, at, off), at, ...between(line, at, last, off)] : [];
}

/** How far a place is from the straight line between two others on the floor. @param {number[]} place @param {number[]} from @param {number[]} to */
function distanceTo([x, , z], [fromX, , fromZ], [toX, , toZ]) {
  const [alongX, alongZ] = [toX - fromX, toZ - fromZ];
  const square = alongX * alongX + alongZ * alongZ;
  const share = square > 0 ? Math.min(Math.max(((x - fromX) * alongX + (z - fromZ) * alongZ) / square, 0), 1) : 0;
  return Math.hypot(x - fromX - share * alongX, z - fromZ - share * alongZ);
}
