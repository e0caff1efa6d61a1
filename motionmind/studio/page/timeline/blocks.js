/** The visible stretches, seams and wishes, each on its track. */

import { html } from "../vendor/htm-preact-standalone.js";
import { trimmed } from "./gestures.js";
import { groupOf } from "./groups.js";
import { inSight, isPosture, nameOf, selectionOf, shown } from "./items.js";
import { clock } from "./scale.js";

const POSTURE_WIDTH_PX = 28; // of a posture, at least: few are held
const MIN_PICTURE_DISTANCE_PX = 100;
const NAME_OFFSET_PX = 52;
const MAX_PICTURES = 16; // of a stretch
const MIN_WISH_OFFSET_PX = 48; // from the piece's start
const OVERSCAN_PX = 300; // rendered beyond the visible range

/** Sign and words for each state of a seam; timeline.css has its pattern. */
const STATES = {
  smooth: ["~", "smooth"],
  abrupt: ["!", "abrupt, being smoothed"],
  waiting: ["…", "not checked yet"],
  inserted: ["", "insertion"],
  discarded: ["×", "insertion discarded"],
  "none found": ["?", "abrupt, no insertion found"],
};

/** The stretches. @param {{does: any, piece: any, sight: any, draft: any, selection: any, thumbnail: any}} props */
export function Stretches({ does, piece, sight, draft, selection, thumbnail }) {
  const { blocks } = piece;
  const [first, stop] = visible(blocks, sight);
  const chosen = nameOf(selection);
  const group = new Set(groupOf(piece, selection).map(({ id }) => id));
  const there = blocks.slice(first, stop);
  const stops = there.some(({ id }) => chosen === `block ${id}`) ? chosen : `block ${there[0]?.id}`;
  return html`<div class="track stretches" role="listbox" aria-label="Stretches" aria-orientation="horizontal" aria-multiselectable="true">
    ${there.map((block, i) => {
      const name = `block ${block.id}`;
      const mine = draft?.id === block.id || draft?.ids?.includes(block.id) ? draft : null;
      const change = mine?.kind === "trim" || mine?.kind === "pace" ? trimmed(block, mine, does.times(block)) : null;
      const held = isPosture(block);
      const seconds = mine?.kind === "hold" ? mine.seconds : (change?.seconds ?? block.seconds);
      const width = Math.max(seconds * sight.scale, held ? POSTURE_WIDTH_PX : 0);
      const strip = held || block.missing ? [] : pictures(block, sight.scale);
      const left = (block.at + (change?.later ?? 0) + seconds / 2) * sight.scale - width / 2;
      const classes = ["stretch", held && "held", block.mirrored && "mirrored", block.missing && "missing", mine?.kind === "move" && "moving"];
      return html`<div
        key=${block.id}
        class=${classes.filter(Boolean).join(" ")}
        role="option"
        data-testid=${`block-${block.id}`}
        data-block=${block.id}
        aria-selected=${group.has(block.id)}
        aria-posinset=${first + i + 1}
        aria-setsize=${blocks.length}
        aria-label=${blockLabel(block)}
        title=${blockLabel(block)}
        tabindex=${stops === name ? 0 : -1}
        style=${{
          left: `${left}px`,
          width: `${Math.max(width, 6)}px`,
          transform: mine?.kind === "move" ? `translateX(${mine.by}px)` : "",
        }}
      >
        ${width > 18 && !block.missing && html`<img alt="" loading="lazy" draggable=${false} src=${thumbnail(block.key, block.first)} />`}
        ${strip.map(({ x, frame }) => html`<img key=${block.repeats > 1 ? `${x} ${frame}` : frame} class="later" alt="" loading="lazy" draggable=${false} src=${thumbnail(block.key, frame)} style=${{ left: `${x}px` }} />`)}
        ${width > 70 && html`<span class="name cut" style=${{ maxWidth: strip.length ? `${strip[0].x - NAME_OFFSET_PX}px` : "" }}>${block.missing ? "? " : ""}${block.mirrored ? "⇋ " : ""}${block.title}${playedAs(block)}</span>`}
        ${!held && html`<i class="edge first" data-edge="first"></i>`}<i class="edge last" data-edge="last"></i>
      </div>`;
    })}
    ${draft?.kind === "move" &&
    html`<div class="landing" aria-hidden="true" style=${{ left: `${landing(piece, draft) * sight.scale}px` }}></div>`}
  </div>`;
}

/** The seams: insertions with their durations, marks elsewhere. */
export function Seams({ piece, sight, draft, selection, over }) {
  const [first, stop] = visible(piece.seams, sight);
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
      const { stands } = seam; // an insertion, perhaps an earlier one until the search ends
      const width = stands ? (mine?.seconds ?? seam.seconds) * sight.scale : POSTURE_WIDTH_PX;
      const left = stands ? seam.at * sight.scale : (seam.at + seam.seconds / 2) * sight.scale - POSTURE_WIDTH_PX / 2;
      const locked = seam.decision === "locked";
      return html`${again(piece, seam).map(
        (later) => html`<i key=${`${name} ${later}`} class=${`seam again ${seam.state.replace(" ", "-")}`} aria-hidden="true" style=${{ left: `${left + later * sight.scale}px`, width: `${Math.max(width, 8)}px` }}></i>`,
      )}<div
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
        aria-label=${seamLabel(seam, word)}
        title=${seamLabel(seam, word)}
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

/** How much later a seam between repeats comes again, seconds. */
function again({ blocks }, { left, right, seconds }) {
  const block = left === right && blocks.find(({ id }) => id === left);
  return block ? Array.from({ length: block.repeats - 2 }, (_, i) => (i + 1) * (block.once + seconds)) : [];
}

/** Wishes for insertions: postures to pass, hands and feet to hold. */
export function Wishes({ piece, sight, thumbnail }) {
  const [first, stop] = visible(piece.seams, sight);
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
      )}<div key=${`${seam.left} ${seam.right}`} class="wish" style=${{ left: `${Math.max(middle * sight.scale, MIN_WISH_OFFSET_PX)}px` }}>
        ${passing.map(({ posture, frame }) => html`<img alt="" class="passing" src=${thumbnail(posture, frame)} />`)}
        ${pins.map(({ joint }) => html`<span class="pin" title=${limbName(joint)}>
          <svg viewBox="0 0 16 16"><path d="M8 9v5M5 2h6l-1 4 2 3H4l2-3z" /></svg>${limbName(joint)}
        </span>`)}
      </div>`;
    })}
  </div>`;
}

/** Further pictures of a stretch; their number doubles with its width, so that the others stay in place. */
function pictures({ first, last, seconds, repeats }, scale) {
  const wide = seconds * scale;
  const count = Math.min(2 ** Math.floor(Math.log2(wide / MIN_PICTURE_DISTANCE_PX)), MAX_PICTURES, (last - first) * repeats);
  const later = Array.from({ length: Math.max(Math.ceil(count) - 1, 0) }, (_, i) => (i + 1) / count);
  const frame = (share) => first + Math.round(((share * repeats) % 1) * (last - first));
  return later.map((share) => ({ x: share * wide, frame: frame(share) }));
}

/** The range of items to render. */
function visible(items, { scale, left, width }) {
  return inSight(items, (left - OVERSCAN_PX) / scale, (left + width + OVERSCAN_PX) / scale);
}

/** The approximate start of a dragged stretch. */
function landing({ blocks, seconds }, { ids, place }) {
  const rest = blocks.filter((block) => !ids.includes(block.id));
  if (place < rest.length) return rest[place].at;
  return seconds;
}

/** Pace and repeats, as a tile shows them. */
function playedAs({ first, last, pace, repeats }) {
  const percent = pace === 1 || first === last ? "" : ` ${Math.round(100 * pace)} %`;
  return `${percent}${repeats > 1 ? ` ×${repeats}` : ""}`;
}

function blockLabel(block) {
  const { title, missing, mirrored, at, seconds, first, last } = block;
  const held = seconds > 0 ? `a posture held ${clock(seconds)} seconds` : "a posture";
  const long = first === last ? held : `${clock(seconds)} seconds`;
  return `${title}${missing ? ", missing" : ""}, ${long}${mirrored ? ", mirrored" : ""}${playedAs(block)}, from ${clock(at)}`;
}

function seamLabel(seam, word) {
  const chosen = seam.alternatives[seam.chosen - 1];
  const said = [`Seam ${seam.number}: ${word}${seam.left === seam.right ? ", between repeats" : ""}`];
  if (seam.state === "inserted") {
    said.push(`${seam.chosen} of ${seam.alternatives.length}, ${clock(seam.seconds)} seconds`);
    if (seam.decision === "locked") said.push("locked");
    said.push(chosen.words);
  } else if (seam.words) said.push(seam.words);
  return said.join(", ");
}

/** A joint in words: the hand for the wrist, the foot for the ankle. */
export function limbName(joint) {
  return joint.replace(/wrist$/, "hand").replace(/ankle$/, "foot").replaceAll("_", " ");
}
