/** What was understood of a file, in words for people. */

/** @typedef {import("./imports.js").Upload} Upload */

/** How long it is and how it was taken. @param {import("./imports.js").Clip} clip */
export function lengthOf({ frames, seconds, fps }) {
  if (frames === 1) return "one posture";
  if (fps === null) return `${frames} postures in ${seconds.toFixed(1)} s, each chosen by hand`;
  return `${seconds.toFixed(1)} s, ${Number(fps.toFixed(2))} frames a second`;
}

/** What body it moves. @param {import("./imports.js").Facts} facts */
export function bodyOf({ joints, rig, people, height }) {
  const tall = `about ${height.toFixed(2)} m tall`;
  if (!people) return `a body of its own, ${joints} joints: corpora of people do not move it`;
  return `a person of ${joints} joints${rig ? ` (${rig})` : ""}, ${tall}`;
}

/** Lines on what is wrong or missing, each with whether it is serious. @param {Upload} file @returns {[string, boolean][]} */
export function doubtsOf({ facts }) {
  if (!facts) return [];
  /** @type {[string, boolean][]} */
  const lines = [];
  if (facts.people && (facts.height < 0.8 || facts.height > 2.6)) lines.push(["no person is so tall: is the unit right?", true]);
  if (facts.doubt) lines.push([`it seems to play ${facts.doubt}; are the frames a second and the unit right?`, true]);
  if (facts.faults.length) {
    const joints = facts.faults.slice(0, 4).map(({ joint, times }) => `${plain(joint)} ${times}×`);
    const more = facts.faults.length > 4 ? " and others" : "";
    lines.push([`joints jump as no body can: ${joints.join(", ")}${more}; this is mended when it is learned`, true]);
  }
  if (facts.filled.length) lines.push([`has no ${facts.filled.map(plain).join(", ")}: they go with what holds them`, false]);
  for (const note of facts.notes) lines.push([note, false]);
  return lines;
}

/** @param {string} joint */
export function plain(joint) {
  return joint.replaceAll("_", " ");
}

/** @param {number} bytes */
export function sizeOf(bytes) {
  return bytes < 2 ** 20 ? `${Math.max(Math.round(bytes / 1024), 1)} KB` : `${(bytes / 2 ** 20).toFixed(1)} MB`;
}
