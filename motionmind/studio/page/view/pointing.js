/** From the pointer and the arrow keys to positions in the viewer's scene, and from positions to pixels. */

import { Vector3 } from "three";

const DIRECTIONS = /** @type {Record<string, number[]>} */ ({
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, -1], // away from the viewer
  PageDown: [0, 0, 1],
});
const KEY_STEP_M = 0.01; // for a body of human size; with Shift five times as far

/**
 * The position under the pointer in the plane through `place` that faces the camera; null behind the camera.
 * @param {PointerEvent} event @param {Element} element covers the view @param {any} camera @param {Vector3} place
 */
export function placeUnder(event, element, camera, place) {
  const { left, top, width, height } = element.getBoundingClientRect();
  const x = (2 * (event.clientX - left)) / width - 1;
  const y = 1 - (2 * (event.clientY - top)) / height;
  const ray = new Vector3(x, y, 0.5).unproject(camera).sub(camera.position).normalize();
  const facing = camera.getWorldDirection(new Vector3());
  const along = ray.dot(facing);
  if (along < 1e-6) return null;
  return ray.multiplyScalar(place.clone().sub(camera.position).dot(facing) / along).add(camera.position);
}

/** By how much a key moves a position, as the camera sees it; null for other keys. @param {KeyboardEvent} event @param {any} camera @param {number} size of the body */
export function keyStep(event, camera, size) {
  const direction = DIRECTIONS[event.key];
  if (!direction || event.ctrlKey || event.metaKey || event.altKey) return null;
  const distance = KEY_STEP_M * size * (event.shiftKey ? 5 : 1);
  return new Vector3(...direction).applyQuaternion(camera.quaternion).multiplyScalar(distance);
}

const seen = new Vector3();

/** Where a position is seen in a view of so many pixels: x, y, and its depth. @param {number[]} place @param {any} camera @param {number} width @param {number} height */
export function pixelOf(place, camera, width, height) {
  seen.fromArray(place).project(camera);
  return [0.5 * (seen.x + 1) * width, 0.5 * (1 - seen.y) * height, seen.z];
}
