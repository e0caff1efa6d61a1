/** Facts about a file in words. */

import { jointName } from "../between/joints.js";

/** @typedef {import("./imports.js").Upload} Upload */

/** Duration and rate of a clip. @param {import("./imports.js").Clip} clip */
export function lengthOf({ frames, seconds, fps }) {
  if (frames === 1) return "one posture";
  if (fps === null) return `${frames} keyframes in ${seconds.toFixed(1)} s`;
  return `${seconds.toFixed(1)} s, ${Number(fps.toFixed(2))} frames a second`;
}

/** The body that it moves. @param {import("./imports.js").Facts} facts */
export function bodyOf({ joints, rig, people, height }) {
  const tall = `about ${height.toFixed(2)} m tall`;
  if (!people) return `not a human body, ${joints} joints: corpora of people cannot move it`;
  return `a person with ${joints} joints${rig ? ` (${rig})` : ""}, ${tall}`;
}

/** Doubtful or missing things, a line each, and whether it is serious. @param {Upload} file @returns {[string, boolean][]} */
export function doubtsOf({ facts }) {
  if (!facts) return [];
  /** @type {[string, boolean][]} */
  const lines = [];
  if (facts.people && (facts.height < 0.8 || facts.height > 2.6)) lines.push(["no person has this height: is the unit right?", true]);
  if (facts.doubt) lines.push([`it seems to play ${facts.doubt}: are the frame rate and the unit right?`, true]);
  if (facts.faults.length) {
    const joints = facts.faults.slice(0, 4).map(({ joint, times }) => `${jointName(joint)} ${times}×`);
    const more = facts.faults.length > 4 ? " and others" : "";
    lines.push([`joints jump: ${joints.join(", ")}${more}; learning repairs this`, true]);
  }
  if (facts.filled.length) lines.push([`has no ${facts.filled.map(jointName).join(", ")}: they follow their parents`, false]);
  for (const note of facts.notes) lines.push([note, false]);
  return lines;
}

/** @param {number} bytes */
export function sizeOf(bytes) {
  return bytes < 2 ** 20 ? `${Math.max(Math.round(bytes / 1024), 1)} KB` : `${(bytes / 2 ** 20).toFixed(1)} MB`;
}
