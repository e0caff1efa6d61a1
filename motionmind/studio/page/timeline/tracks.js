/** The tracks under the ruler, which scroll together, and their pointer and key events. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { dropped, POSTURE_TYPE } from "../between/desk.js";
import { castOf } from "../dancers/cast.js";
import { Lanes } from "../dancers/lanes.js";
import { MusicLane } from "../music/lane.js";
import { useChange } from "../shell/hooks.js";
import { Seams, Stretches, Wishes } from "./blocks.js";
import { Drag } from "./gestures.js";
import { groupOf, reaching } from "./groups.js";
import { nameOf, placeAt, selected } from "./items.js";
import { act, KEYS } from "./keys.js";
import { Notes } from "./notes.js";
import { Playhead, Ruler } from "./ruler.js";

const LEAD_PX = 16; // before the piece, as in timeline.css: a posture at its start extends to both sides of 0
const END_PX = 160; // after the piece, to drop postures

export function Tracks({ does, piece, whole, sight, selection, meter, thumbnail }) {
  const scroller = useRef(null);
  const drag = useRef(null);
  const [draft, setDraft] = useState(null);
  const [over, setOver] = useState("");

  useLayoutEffect(() => {
    const { current } = scroller;
    const measure = () => does.show({ width: current.clientWidth });
    const observer = new ResizeObserver(measure);
    observer.observe(current);
    measure(); // a hidden window's observer does not run
    // Preact's wheel listeners are passive: the page would zoom too.
    const wheel = (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      does.zoom(Math.exp(-event.deltaY / 240), event.clientX - edgeOf(current));
    };
    current.addEventListener("wheel", wheel, { passive: false });
    return () => {
      observer.disconnect();
      current.removeEventListener("wheel", wheel);
    };
  }, [does]);

  useLayoutEffect(() => {
    if (Math.abs(scroller.current.scrollLeft - sight.left) > 1) scroller.current.scrollLeft = sight.left;
  }, [sight.left, sight.scale]);

  // Keep the keyboard focus when the tracks are rendered again.
  useEffect(() => {
    const item = selected(piece, selection);
    if (!item) return;
    const { at, seconds } = item.block ?? item.seam;
    does.reveal(at, seconds);
  }, [JSON.stringify(selection)]);
  useLayoutEffect(() => {
    const { activeElement: at } = document;
    if (!does.focused || !(at === document.body || at?.closest("[role=option]"))) return;
    const chosen = scroller.current.querySelector("[aria-selected=true][tabindex='0']");
    if (chosen && chosen !== at) chosen.focus({ preventScroll: true });
  });

  const down = (event) => {
    if (event.button !== 0) return;
    const held = heldBy(event, piece);
    if (!held) return;
    does.focused = true;
    does.look();
    const group = groupOf(piece, selection);
    const within = held.kind === "move" && group.includes(held.block);
    if (event.shiftKey && held.block) {
      does.studio.store.set({ selection: reaching(selection, held.block.id) });
      return;
    }
    if (!within) does.select(held.block ? { block: held.block } : { seam: held.seam });
    held.group = within ? group : [held.block];
    if (held.kind !== "select" && !(event.pointerType === "touch" && held.kind === "move" && !held.chosen)) {
      event.currentTarget.setPointerCapture(event.pointerId);
      drag.current = new Drag(does, held, event);
    }
  };
  const moved = (event) => {
    if (drag.current) setDraft(drag.current.take(event, edgeOf(scroller.current)));
  };
  const up = async () => {
    const ending = drag.current;
    drag.current = null;
    if (ending && !ending.moved && ending.held.block) does.select({ block: ending.held.block }); // alone
    await ending?.end();
    setDraft(null);
  };
  const cancel = () => {
    drag.current = null;
    setDraft(null);
  };
  const key = (event) => {
    if (event.key === "Escape" && drag.current) cancel();
    else if (event.target.closest("[role=option]")) act(event, KEYS, does);
  };
  const dragOver = (event) => {
    if (!event.dataTransfer.types.includes(POSTURE_TYPE)) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
    setOver(event.target.closest("[data-left]")?.dataset.left ?? "track");
  };
  const drop = (event) => {
    setOver("");
    const posture = dropped(event);
    if (!posture) return;
    event.preventDefault();
    const onto = heldBy(event, piece)?.seam;
    if (onto && (posture.last ?? 0) > posture.frame) {
      does.studio.say("An insertion passes single postures: open the clip and drag a frame here.", { kind: "note" });
    } else if (onto) {
      const { left, width } = event.target.closest("[data-left]").getBoundingClientRect();
      does.pass(onto, { posture: posture.key, frame: posture.frame }, (event.clientX - left) / width);
    } else {
      const x = event.clientX - edgeOf(scroller.current) + sight.left;
      does.insert(posture, placeAt(piece, x / sight.scale));
    }
  };
  const cast = castOf(does.studio);
  const danced = useChange(cast, () => cast.data !== null);
  const music = html`<${MusicLane} does=${does} sight=${sight} meter=${meter} />`;
  return html`<div
    class=${over ? "tracks dropping" : "tracks"}
    ref=${scroller}
    onScroll=${(event) => does.show({ left: event.currentTarget.scrollLeft })}
    onDragOver=${dragOver}
    onDragLeave=${() => setOver("")}
    onDrop=${drop}
  >
    <div class="inner" style=${{ width: `${Math.max(whole * sight.scale + END_PX, sight.width)}px` }}>
      <${Ruler} does=${does} sight=${sight} seconds=${piece.seconds} meter=${meter} />
      ${!danced && music}
      <${Notes} does=${does} notes=${piece.notes} sight=${sight} />
      <div
        onPointerDown=${down}
        onPointerMove=${moved}
        onPointerUp=${up}
        onPointerCancel=${cancel}
        onKeyDown=${key}
        onfocusin=${(event) => focusIn(event, does, piece)}
        onfocusout=${({ relatedTarget }) => {
          // An element that is removed with the focus has no relatedTarget.
          if (relatedTarget && !relatedTarget.closest("[role=option]")) does.focused = false;
        }}
        onDblClick=${(event) => openAt(event, does, piece)}
      >
        <${Wishes} piece=${piece} sight=${sight} thumbnail=${thumbnail} />
        <${Seams} piece=${piece} sight=${sight} draft=${draft} selection=${selection} over=${over} />
        <${Stretches}
          does=${does}
          piece=${piece}
          sight=${sight}
          draft=${draft}
          selection=${selection}
          thumbnail=${thumbnail}
        />
      </div>
      <${Playhead} does=${does} scale=${sight.scale} />
      ${danced && html`<${Lanes} does=${does} sight=${sight}>${music}<//>`}
    </div>
  </div>`;
}

/** The window's x of time 0 without scrolling, pixels. */
function edgeOf(scroller) {
  return scroller.getBoundingClientRect().left + LEAD_PX;
}

/** The stretch, edge or insertion under the pointer; null if there is none. */
function heldBy(event, piece) {
  const element = event.target.closest("[role=option]");
  if (!element) return null;
  const edge = event.target.closest("[data-edge]")?.dataset.edge;
  const chosen = element.getAttribute("aria-selected") === "true";
  const { block: id, left, right } = element.dataset;
  if (id) {
    const block = piece.blocks.find((one) => one.id === id);
    return block && { kind: edge ? "trim" : "move", side: edge, block, chosen };
  }
  const seam = piece.seams.find((one) => one.left === left && one.right === right);
  return seam && { kind: edge ? "last" : "select", seam, chosen };
}

/** Select the focused item. */
function focusIn(event, does, piece) {
  does.focused = true;
  const held = heldBy(event, piece);
  const { selection } = does.studio.store;
  if (!held || groupOf(piece, selection).includes(held.block)) return;
  if (nameOf(selection) !== nameOf(held.block ? { block: held.block.id } : { seam: [held.seam.left, held.seam.right] }))
    does.select(held.block ? { block: held.block } : { seam: held.seam });
}

function openAt(event, does, piece) {
  const held = heldBy(event, piece);
  if (held?.seam) does.show({ sheet: true });
  else if (held?.block) does.seek(held.block.at);
}
