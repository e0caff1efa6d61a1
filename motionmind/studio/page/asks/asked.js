/** The insertion that the user asks about in the viewer: its wishes, and where it is in the movement shown. */

import { deskOf } from "../between/desk.js";
import { selected, wish } from "../timeline/items.js";

/**
 * @typedef {{joint: string, place: [number, number, number], at: number}} Reach a place for a joint, metres: left of, above
 *   and ahead of the floor under the first posture; and when, seconds from it
 * @typedef {(reaches: Reach[]) => Reach[]} Change
 * @typedef {{points: [number, number][], facing: number | null}} Travel a path, x and z of each point, as above; degrees
 * @typedef {{name: string, ask: import("../timeline/items.js").Ask, begin: number, seconds: number, place: [number, number],
 *   turn: number, locked: boolean, change: (change: Change) => unknown,
 *   draw: ((travel: Travel | null) => unknown) | null, off: string}} Asked `begin`, `place` and `turn` say where the
 *   insertion is in the viewer's movement, `off` how near it keeps to its path
 */

export const MAX_REACHES = 20;
export const MAX_POINTS = 64; // of a path

/** The question in the viewer; null if there is none. @param {any} studio @returns {Asked | null} */
export function askedOf(studio) {
  const { viewer, store } = studio;
  const desk = deskOf(studio);
  if (desk.looking) {
    const ask = { seconds: null, passing: [], pins: [], reaches: desk.reaches, travel: null };
    const change = (/** @type {Change} */ make) => desk.reach(make(desk.reaches));
    return { name: "desk", ask, begin: 0, seconds: desk.scene.end, place: [0, 0], turn: 0, locked: false, change, draw: null, off: "" };
  }
  const alone = viewer.isHome && viewer.motion && !viewer.motion.dancers; // of several dancers, which one would reach?
  const piece = alone && store.state?.piece;
  const seam = piece && selected(piece, store.selection)?.seam;
  const part = seam?.stands && piece.parts.find((/** @type {any} */ one) => one.inserted && one.at === seam.at);
  if (!part) return null;
  const { left, right, ask, at, seconds } = seam;
  const edit = (/** @type {(ask: any) => any} */ make) =>
    studio.act(async () => {
      await studio.api.changed; // wishes after all earlier edits
      const now = selected(store.state.piece, { seam: [left, right] })?.seam;
      if (now) await studio.api.edit(wish(now, make(now.ask)));
    });
  const change = (/** @type {Change} */ make) => edit(({ reaches }) => ({ reaches: make(reaches) }));
  const draw = (/** @type {Travel | null} */ travel) => edit(() => ({ travel }));
  const { place, turn } = part;
  const name = `${left} ${right}`;
  return { name, ask, begin: at, seconds, place, turn, locked: seam.decision === "locked", change, draw, off: offOf(seam) };
}

/** How near an insertion keeps to its path, in words. @param {import("../timeline/items.js").Seam} seam */
function offOf({ state, ask, alternatives, chosen }) {
  if (!ask.travel) return "";
  if (state !== "inserted") return "searching";
  const words = alternatives[chosen - 1].words.split("; ");
  const at = words.findIndex((one) => one.startsWith("travels "));
  const off = words[at + 1]?.endsWith(" off the path") ? `; ${words[at + 1]}` : "";
  return at < 0 ? "" : words[at] + off;
}

/** A position of the insertion in the viewer's scene. @param {Asked} asked @param {number[]} place @returns {[number, number, number]} */
export function toScene({ place: [dx, dz], turn }, [x, y, z]) {
  const [sine, cosine] = [Math.sin(turn), Math.cos(turn)];
  return [x * cosine + z * sine + dx, y, z * cosine - x * sine + dz];
}

/** A position of the viewer's scene in the insertion. @param {Asked} asked @param {number[]} place @returns {[number, number, number]} */
export function fromScene({ place: [dx, dz], turn }, [x, y, z]) {
  const [sine, cosine] = [Math.sin(turn), Math.cos(turn)];
  return [(x - dx) * cosine - (z - dz) * sine, y, (z - dz) * cosine + (x - dx) * sine];
}

/** The position of a joint in the viewer at a time of its movement. @param {any} viewer @param {string} joint @param {number} time @returns {number[]} */
export function jointAt({ motion }, joint, time) {
  const { body, joints } = motion;
  const [rotations, root] = [new Float64Array(joints.length * 4), new Float64Array(3)];
  motion.sample(time, rotations, root);
  body.pose(rotations, root);
  const at = 3 * joints.indexOf(joint);
  return Array.from(body.joints.subarray(at, at + 3));
}

/** The hands and feet of the body in the viewer, by their joints. @param {any} viewer @returns {string[]} */
export function limbsOf({ motion }) {
  const { hands, feet } = motion.body.trails;
  return [...hands, ...feet].map(({ joint }) => motion.joints[joint]);
}

/** A place for a joint: where it is now, at the playhead; null outside of the insertion. @param {any} viewer @param {Asked} asked @param {string} joint @returns {Reach | null} */
export function reachNow(viewer, asked, joint) {
  const at = within(asked, viewer.player.time - asked.begin);
  return at === null ? null : { joint, place: rounded(fromScene(asked, jointAt(viewer, joint, asked.begin + at))), at };
}

/** A time between both ends of an insertion, in hundredths of a second; null if it is not. @param {{seconds: number}} asked @param {number} at */
export function within({ seconds }, at) {
  const time = Math.round(100 * at) / 100;
  return time > 0 && time < seconds ? time : null;
}

/** A position in whole millimetres. @param {[number, number, number]} place @returns {[number, number, number]} */
export function rounded([x, y, z]) {
  return [millimetre(x), millimetre(y), millimetre(z)];
}

/** @param {number} metres */
export function millimetre(metres) {
  return Math.round(1000 * metres) / 1000;
}
