/** Several stretches selected together: from one that stays, `from`, to the one with the focus, `block`. */

import { duplicate, move, newId, wish } from "./items.js";

/** @typedef {import("./items.js").Block} Block @typedef {import("./items.js").Piece} Piece */

/** The selected stretches, in order. @param {Piece} piece @param {any} selection @returns {Block[]} */
export function groupOf({ blocks }, selection) {
  if (!selection?.block) return [];
  const ends = [selection.block, selection.from ?? selection.block].map((wanted) => blocks.findIndex(({ id }) => id === wanted));
  if (ends[0] < 0) return [];
  const other = ends[1] < 0 ? ends[0] : ends[1];
  return blocks.slice(Math.min(ends[0], other), Math.max(ends[0], other) + 1);
}

/** The selection that reaches to another stretch. @param {any} selection @param {string} block */
export function reaching(selection, block) {
  return { block, from: selection?.from ?? selection?.block ?? block };
}

/** Edit each stretch; a single one without more words. @param {any[]} edits @param {string} verb */
export function together(edits, verb) {
  if (edits.length < 2) return edits[0] ?? null;
  return { edit: "several", edits, words: `${verb} ${edits.length} stretches` };
}

/** Move stretches to the index `to` among the others; null if they are there. @param {Piece} piece @param {Block[]} group */
export function moveGroup(piece, group, to) {
  if (group.length < 2) return group.length ? move(piece, group[0], to) : null;
  const ids = group.map(({ id }) => id);
  const rest = piece.blocks.filter(({ id }) => !ids.includes(id));
  const place = Math.min(Math.max(to, 0), rest.length);
  if (place === piece.blocks.findIndex(({ id }) => id === ids[0])) return null;
  return together(ids.map((block) => ({ edit: "move", block, before: rest[place]?.id ?? null })), "move");
}

/**
 * Copy stretches after the last of them, with the wishes and choices between them.
 * @param {Piece} piece @param {Block[]} group @param {string} window
 */
export function copyGroup(piece, group, window) {
  const ids = group.map(() => newId(window));
  const { before } = duplicate(piece, group[group.length - 1], "");
  const copies = group.map((block, i) => ({ ...duplicate(piece, block, ids[i]), before }));
  const choices = group.slice(1).flatMap((block, i) => {
    const seam = piece.seams.find(({ left, right }) => left === group[i].id && right === block.id);
    return seam ? choicesAt({ ...seam, left: ids[i], right: ids[i + 1] }) : [];
  });
  const words = `duplicate ${copies.length} stretches`;
  return { ids, edit: group.length < 2 ? copies[0] : { edit: "several", edits: [...copies, ...choices], words } };
}

/** Edits that repeat the wishes and the choice at a seam. @param {import("./items.js").Seam} seam */
export function choicesAt(seam) {
  const { left, right, ask, chosen, decision } = seam;
  const edits = [];
  if (ask.seconds !== null || ask.travel || ask.passing.length + ask.pins.length + ask.reaches.length > 0) edits.push(wish(seam, {}));
  if (chosen > 1) edits.push({ edit: "choose", left, right, alternative: chosen });
  if (decision === "discarded") edits.push({ edit: "decide", left, right, decision });
  return edits;
}
