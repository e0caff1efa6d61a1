/** Stretches on their track, and the marks of seams on theirs: what is in sight of them. */

import { html } from "../vendor/htm-preact-standalone.js";
import { trimmed } from "./gestures.js";
import { inSight, nameOf, selectionOf, shown } from "./items.js";
import { clock } from "./scale.js";

const LEAST = 28; // pixels of a held posture, which takes no time
const APART = 100; // pixels from one picture of a stretch to the next, at least
const NAMED = 52; // pixels before a stretch's name
const PICTURES = 16; // of a stretch, at most
const CLEAR = 48; // pixels from the piece's beginning to the middle of what is wished there
const ROOM = 300; // pixels beside what is in sight that are there already

/** A word and a sign for each state of a seam; its pattern is in timeline.css. */
const STATES = {
  smooth: ["~", "goes over smoothly"],
  abrupt: ["!", "abrupt, being smoothed"],
  waiting: ["…", "not looked at yet"],
  inserted: ["", "insertion"],
  discarded: ["×", "insertion left out"],
  "none found": ["?", "abrupt, and nothing found"],
};

/** The stretches. @param {{does: any, piece: any, sight: any, draft: any, selection: any, thumbnail: any}} props */
export function Stretches({ does, piece, sight, draft, selection, thumbnail }) {
  const { blocks } = piece;
  const [first, stop] = seen(blocks, sight);
  const chosen = nameOf(selection);
  const there = blocks.slice(first, stop);
  const stops = there.some(({ id }) => chosen === `block ${id}`) ? chosen : `block ${there[0]?.id}`;
  return html`<div class="track stretches" role="listbox" aria-label="Stretches" aria-orientation="horizontal">
    ${there.map((block, i) => {
      const name = `block ${block.id}`;
      const mine = draft?.id === block.id ? draft : null;
      const change = mine?.kind === "trim" ? trimmed(block, mine, does.times(block)) : null;
      const held = block.first === block.last;
      const width = held ? LEAST : (change?.seconds ?? block.seconds) * sight.scale;
      const strip = held || block.missing ? [] : pictures(block, sight.scale);
      const left = (block.at + (change?.later ?? 0)) * sight.scale - (held ? LEAST / 2 : 0);
      const classes = ["stretch", held && "held", block.mirrored && "mirrored", block.missing && "missing", mine?.kind === "move" && "moving"];
      return html`<div
        key=${block.id}
        class=${classes.filter(Boolean).join(" ")}
        role="option"
        data-testid=${`block-${block.id}`}
        data-block=${block.id}
        aria-selected=${chosen === name}
        aria-posinset=${first + i + 1}
        aria-setsize=${blocks.length}
        aria-label=${labelOf(block)}
        title=${labelOf(block)}
        tabindex=${stops === name ? 0 : -1}
        style=${{
          left: `${left}px`,
          width: `${Math.max(width, 6)}px`,
          transform: mine?.kind === "move" ? `translateX(${mine.by}px)` : "",
        }}
      >
        ${width > 18 && !block.missing && html`<img alt="" loading="lazy" draggable=${false} src=${thumbnail(block.key, block.first)} />`}
        ${strip.map(({ x, frame }) => html`<img key=${frame} class="later" alt="" loading="lazy" draggable=${false} src=${thumbnail(block.key, frame)} style=${{ left: `${x}px` }} />`)}
        ${width > 70 && html`<span class="name cut" style=${{ maxWidth: strip.length ? `${strip[0].x - NAMED}px` : "" }}>${block.missing ? "? " : ""}${block.mirrored ? "⇋ " : ""}${block.title}</span>`}
        ${!held && html`<i class="edge first" data-edge="first"></i><i class="edge last" data-edge="last"></i>`}
      </div>`;
    })}
    ${draft?.kind === "move" &&
    html`<div class="landing" aria-hidden="true" style=${{ left: `${landing(piece, draft) * sight.scale}px` }}></div>`}
  </div>`;
}

/** The seams: insertions as long as they last, and a mark where there is none. */
export function Seams({ piece, sight, draft, selection, over }) {
  const [first, stop] = seen(piece.seams, sight);
  const chosen = nameOf(selection);
  const there = piece.seams.slice(first, stop).filter(shown);
  const names = there.map((seam) => nameOf(selectionOf({ seam })));
  const stops = names.includes(chosen) ? chosen : names[0];
  return html`<div class="track seams" role="listbox" aria-label="Seams and insertions" aria-orientation="horizontal">
    ${there.map((seam) => {
      const name = nameOf(selectionOf({ seam }));
      const mine = draft?.kind === "last" && draft.left === seam.left && draft.right === seam.right ? draft : null;
      const [sign, word] = STATES[seam.state];
      const inserted = seam.state === "inserted";
      const { stands } = seam; // what is inserted, or was until another is found
      const width = stands ? (mine?.seconds ?? seam.seconds) * sight.scale : LEAST;
      const left = stands ? seam.at * sight.scale : (seam.at + seam.seconds / 2) * sight.scale - LEAST / 2;
      const locked = seam.decision === "locked";
      return html`<div
        key=${name}
        class=${`seam ${seam.state.replace(" ", "-")}${locked ? " locked" : ""}${over === seam.left ? " target" : ""}`}
        role="option"
        data-testid=${`insertion-${seam.number}`}
        data-state=${seam.state}
        data-left=${seam.left}
        data-right=${seam.right}
        aria-selected=${chosen === name}
        aria-posinset=${seam.number}
        aria-setsize=${piece.seams.length}
        aria-label=${sayOf(seam, word)}
        title=${sayOf(seam, word)}
        tabindex=${stops === name ? 0 : -1}
        style=${{ left: `${left}px`, width: `${Math.max(width, 8)}px` }}
      >
        ${locked && width > 40 && html`<svg viewBox="0 0 16 16" aria-hidden="true"><path d="M4 7h8v6H4zM6 7V5a2 2 0 0 1 4 0v2" /></svg>`}
        ${inserted
          ? width > 56 && html`<span class="numbers">${seam.chosen} of ${seam.alternatives.length}</span>`
          : html`<b aria-hidden="true">${sign}</b>`}
        ${inserted && !locked && html`<i class="edge last" data-edge="last"></i>`}
      </div>`;
    })}
  </div>`;
}

/** What is wished of insertions: postures to pass, hands and feet that stay. */
export function Wishes({ piece, sight, thumbnail }) {
  const [first, stop] = seen(piece.seams, sight);
  const wished = piece.seams.slice(first, stop).filter(({ ask }) => ask.passing.length + ask.pins.length > 0);
  return html`<div class="track wishes" aria-hidden="true">
    ${wished.map((seam) => {
      const { passing, pins } = seam.ask;
      const middle = seam.at + seam.seconds / 2;
      const stays = pins.filter(({ hold }) => hold === "place");
      return html`${stays.map(
        ({ begins, ends }) => html`<i
          class="stay"
          style=${{ left: `${(seam.at + begins * seam.seconds) * sight.scale}px`, width: `${(ends - begins) * seam.seconds * sight.scale}px` }}
        ></i>`,
      )}<div key=${`${seam.left} ${seam.right}`} class="wish" style=${{ left: `${Math.max(middle * sight.scale, CLEAR)}px` }}>
        ${passing.map(({ posture, frame }) => html`<img alt="" class="passing" src=${thumbnail(posture, frame)} />`)}
        ${pins.map(({ joint }) => html`<span class="pin" title=${plain(joint)}>
          <svg viewBox="0 0 16 16"><path d="M8 9v5M5 2h6l-1 4 2 3H4l2-3z" /></svg>${plain(joint)}
        </span>`)}
      </div>`;
    })}
  </div>`;
}

/** Where else than at its beginning a stretch is pictured; twice as often when it is twice as wide, so that all others stay. */
function pictures({ first, last, seconds }, scale) {
  const wide = seconds * scale;
  const count = Math.min(2 ** Math.floor(Math.log2(wide / APART)), PICTURES, last - first);
  const later = Array.from({ length: Math.max(Math.ceil(count) - 1, 0) }, (_, i) => (i + 1) / count);
  return later.map((share) => ({ x: share * wide, frame: first + Math.round(share * (last - first)) }));
}

/** The numbers of those items that are in sight, or nearly. */
function seen(items, { scale, left, width }) {
  return inSight(items, (left - ROOM) / scale, (left + width + ROOM) / scale);
}

/** When a stretch that is dragged will begin, about. */
function landing({ blocks, seconds }, { id, place }) {
  const rest = blocks.filter((block) => block.id !== id);
  if (place < rest.length) return rest[place].at;
  return seconds;
}

function labelOf({ title, missing, mirrored, at, seconds, first, last }) {
  const long = first === last ? "a posture" : `${clock(seconds)} seconds`;
  return `${title}${missing ? ", missing" : ""}, ${long}${mirrored ? ", mirrored" : ""}, from ${clock(at)}`;
}

function sayOf(seam, word) {
  const chosen = seam.alternatives[seam.chosen - 1];
  const said = [`Seam ${seam.number}: ${word}`];
  if (seam.state === "inserted") {
    said.push(`${seam.chosen} of ${seam.alternatives.length}, ${clock(seam.seconds)} seconds`);
    if (seam.decision === "locked") said.push("locked");
    said.push(chosen.words);
  } else if (seam.words) said.push(seam.words);
  return said.join(", ");
}

/** What a joint's name stands for, in words: a hand hangs from the wrist, a foot from the ankle. */
export function plain(joint) {
  return joint.replace(/wrist$/, "hand").replace(/ankle$/, "foot").replaceAll("_", " ");
}
