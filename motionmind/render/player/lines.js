/** Lines on the floor. */

import { BufferGeometry, Color, DoubleSide, Float32BufferAttribute, Mesh, MeshBasicMaterial, SRGBColorSpace } from "three";

const WIDTH = 0.018; // of a line, metres, for a body 1.70 m tall
const EDGE = "#8d8d94"; // of a stage; seen on light paper and on dark

/** The corners of an area of the floor around the origin, x and z. @param {[number, number]} area width and depth, metres */
export function corners([width, depth]) {
  const [x, z] = [width / 2, depth / 2];
  return [[-x, -z], [x, -z], [x, z], [-x, z]];
}

/** The edge of an area of the floor. @param {[number, number]} area width and depth, metres @param {number} size of the body */
export function edge(area, size) {
  const around = corners(area);
  return strips(around.map((corner, i) => [corner, around[(i + 1) % 4]]), 1.5 * size, EDGE);
}

/** Lines over the floor, each from one place to another, as wide as WIDTH for a body of this size. */
export function strips(lines, size, colour) {
  const half = 0.5 * WIDTH * size;
  const faces = lines.flatMap(([[x, z], [toX, toZ]]) => {
    const long = Math.hypot(toX - x, toZ - z) || 1;
    const [acrossX, acrossZ] = [(-half * (toZ - z)) / long, (half * (toX - x)) / long];
    const [a, b] = [[x + acrossX, 0, z + acrossZ], [x - acrossX, 0, z - acrossZ]];
    const [c, d] = [[toX + acrossX, 0, toZ + acrossZ], [toX - acrossX, 0, toZ - acrossZ]];
    return [a, b, c, c, b, d].flat();
  });
  const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(faces, 3));
  const material = new MeshBasicMaterial({ color: new Color().setStyle(colour, SRGBColorSpace), side: DoubleSide });
  Object.assign(material, { depthTest: false, depthWrite: false, toneMapped: false });
  const mesh = new Mesh(geometry, material);
  mesh.renderOrder = -0.5; // on the floor, under the shadow
  mesh.frustumCulled = false;
  return mesh;
}
