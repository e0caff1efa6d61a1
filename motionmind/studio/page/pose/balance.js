/** The balance of the posture over the view: the vertical through the centre of mass, and the area that the feet support. */

import { Vector3 } from "three";

const SVG = "http://www.w3.org/2000/svg";
const CROSS_M = 0.05; // half the length of its arms on the floor

/** @typedef {{mass: [number, number, number], support: [number, number][], outside: number | null}} Balance */

export class BalanceMark {
  constructor() {
    this.element = document.createElementNS(SVG, "svg");
    this.element.setAttribute("class", "pose-balance");
    this.element.setAttribute("aria-hidden", "true"); // the panel says it in words
    this.element.dataset.testid = "balance-mark";
    this.area = this.element.appendChild(document.createElementNS(SVG, "polygon"));
    this.line = this.element.appendChild(document.createElementNS(SVG, "path"));
    this.point = new Vector3();
  }

  /** @param {Balance | null} balance @param {any} camera @param {number} width @param {number} height pixels of the view */
  follow(balance, camera, width, height) {
    this.element.classList.toggle("off", Boolean(balance?.outside));
    this.element.toggleAttribute("hidden", !balance);
    if (!balance) return;
    const seen = (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z) => {
      this.point.set(x, y, z).project(camera);
      return `${(0.5 * (this.point.x + 1) * width).toFixed(1)},${(0.5 * (1 - this.point.y) * height).toFixed(1)}`;
    };
    const { mass, support } = balance;
    const [x, y, z] = mass;
    this.area.setAttribute("points", support.map((corner) => seen(corner[0], 0, corner[1])).join(" "));
    const cross = `M${seen(x - CROSS_M, 0, z)}L${seen(x + CROSS_M, 0, z)}M${seen(x, 0, z - CROSS_M)}L${seen(x, 0, z + CROSS_M)}`;
    this.line.setAttribute("d", `M${seen(x, y, z)}L${seen(x, 0, z)}${cross}`);
  }
}

/** @param {Balance | null} balance */
export function balanceWords(balance) {
  if (!balance) return "";
  if (balance.outside === null) return "In the air: no foot stands.";
  if (balance.outside === 0) return "In balance over the feet.";
  return `Out of balance: ${Math.max(1, Math.round(100 * balance.outside))} cm beyond the feet.`;
}
