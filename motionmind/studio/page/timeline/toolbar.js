/** The bar above the tracks: actions on the selection, progress of smoothing, tempo and zoom. */

import { html } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { selected } from "./items.js";
import { clock } from "./scale.js";

const ICONS = {
  split: "M8 1v14M5 4 2 8l3 4M11 4l3 4-3 4",
  duplicate: "M5 5h9v9H5zM2 11V2h9",
  mirror: "M8 1v14M5 4v8L1 8zM11 4v8l4-4z",
  delete: "M2 4h12M6 4V2h4v2M4 4l1 10h6l1-10",
  locked: "M4 7h8v7H4zM6 7V5a2 2 0 0 1 4 0v2",
  open: "M4 7h8v7H4zM6 7V4a2 2 0 0 1 4-1",
  wishes: "M2 4h12M2 8h12M2 12h12M5 2v4M11 6v4M7 10v4",
  out: "M3 8h10",
  in: "M3 8h10M8 3v10",
  fit: "M1 3v10M15 3v10M4 8h8M4 8l2-2M4 8l2 2M12 8l-2-2M12 8l-2 2",
};

function Icon({ name }) {
  return html`<svg viewBox="0 0 16 16" aria-hidden="true"><path d=${ICONS[name]} /></svg>`;
}

/** @param {{does: any, piece: any, selection: any, tempo: number, onTempo: (tempo: number) => void, stopped: boolean,
 *   onStop: (stopped: boolean) => void, sheet: boolean}} props */
export function Toolbar({ does, piece, selection, tempo, onTempo, stopped, onStop, sheet }) {
  const item = selected(piece, selection);
  return html`<div class="toolbar row" role="toolbar" aria-label="Time line">
    <h2 class="aside">Time line</h2>
    ${item?.block && html`<${OfStretch} does=${does} block=${item.block} />`}
    ${item?.seam && html`<${OfSeam} does=${does} seam=${item.seam} sheet=${sheet} />`}
    ${!item && html`<p class="hint grow cut">${hintFor(piece)}</p>`}
    <${Smoothing} piece=${piece} stopped=${stopped} onStop=${onStop} />
    <label class="tempo" title="Beats a minute, for the ruler's counts">
      <span class="pale">♩=</span>
      <${NumberField}
        min="20"
        max="300"
        step="1"
        value=${tempo}
        data-testid="tempo"
        aria-label="Tempo, beats a minute"
        use=${(given) => {
          const beats = Math.min(Math.max(given || 120, 20), 300);
          onTempo(beats);
          return beats;
        }}
      />
    </label>
    <div class="zoom row">
      <${Button} icon="out" words="Zoom out (−)" does=${() => does.zoomOut()} test="zoom-out" />
      <${Button} icon="fit" words="Show the whole piece (0)" does=${() => does.fit()} test="zoom-fit" />
      <${Button} icon="in" words="Zoom in (+)" does=${() => does.zoomIn()} test="zoom-in" />
    </div>
  </div>`;
}

function OfStretch({ does, block }) {
  return html`<p class="grow cut" data-testid="selected">
      <b>${block.title}</b>${" "}<span class="pale numbers"
        >${block.mirrored ? "mirrored, " : ""}${clock(block.seconds)} s · frames ${block.first} to ${block.last} of ${block.frames}</span
      >
    </p>
    <${Button} icon="split" words="Split (S)" does=${() => does.split()} test="split" />
    <${Button} icon="duplicate" words="Duplicate (D)" does=${() => does.duplicate()} test="duplicate" />
    <${Button} icon="mirror" words="Mirror (M)" does=${() => does.mirror()} test="mirror" />
    <${Button} icon="delete" words="Delete (Del)" does=${() => does.remove()} test="delete" />`;
}

function OfSeam({ does, seam, sheet }) {
  const { state, alternatives, chosen, decision, words } = seam;
  const any = alternatives.length > 0;
  const locked = decision === "locked";
  return html`<p class="grow cut" data-testid="selected">
      <b>${seam.stands ? `Insertion, ${clock(seam.seconds)} s` : any ? "Insertion, discarded" : "Seam"}</b>${" "}
      <span class="pale">${state === "inserted" ? withoutDuration(alternatives[chosen - 1].words) : seam.stands ? "searching for another" : words}</span>
    </p>
    ${any &&
    html`<div class="row flip">
        <button
          class="button icon"
          data-testid="previous"
          aria-label="Previous alternative (↑)"
          title="Previous alternative (↑)"
          disabled=${alternatives.length < 2 || locked}
          onClick=${() => does.flip(-1)}
        >
          ‹
        </button>
        <span class="numbers" data-testid="chosen">${chosen} of ${alternatives.length}</span>
        <button
          class="button icon"
          data-testid="next"
          aria-label="Next alternative (↓)"
          title="Next alternative (↓)"
          disabled=${alternatives.length < 2 || locked}
          onClick=${() => does.flip(1)}
        >
          ›
        </button>
      </div>
      <${Button}
        icon=${locked ? "locked" : "open"}
        words=${locked ? "Unlock (L)" : "Lock (L)"}
        pressed=${locked}
        does=${() => does.lock()}
        test="lock"
      />
      <button class="button" data-testid="discard" onClick=${() => does.remove()}>
        ${decision === "discarded" ? "Restore" : "Discard"}
      </button>`}
    <${Button}
      icon="wishes"
      words="Wishes: duration, postures, hands and feet (W)"
      pressed=${sheet}
      does=${() => does.show({ sheet: !sheet })}
      test="wishes"
    />`;
}

/** Progress of smoothing in the background. */
function Smoothing({ piece, stopped, onStop }) {
  const open = piece.seams.filter(({ state }) => state === "waiting" || state === "abrupt").length;
  if (open === 0) return html`<span class="smoothing" role="status"></span>`;
  const all = piece.seams.length;
  return html`<div class="smoothing row" data-testid="smoothing">
    <span role="status" class="numbers pale">${stopped ? "paused" : "smoothing"}: ${open} of ${all} seams</span>
    <progress max=${all} value=${all - open} aria-label="Finished seams"></progress>
    <button class="button" data-testid="smoothing-stop" onClick=${() => onStop(!stopped)}>${stopped ? "Resume" : "Pause"}</button>
  </div>`;
}

function Button({ icon, words, does, test, pressed }) {
  return html`<button
    class="button icon"
    data-testid=${test}
    title=${words}
    aria-label=${words}
    aria-pressed=${pressed === undefined ? undefined : String(pressed)}
    onClick=${does}
  >
    <${Icon} name=${icon} />
  </button>`;
}

/** An insertion's description without its duration. */
function withoutDuration(words) {
  return words.split("; ").filter((one) => !/^[\d.]+ s$/.test(one)).join("; ");
}

function hintFor({ blocks, seconds }) {
  if (blocks.length === 0) return "Empty: accept an alternative, or drag a posture here.";
  return `${blocks.length} stretch${blocks.length === 1 ? "" : "es"}, ${clock(seconds)} s. Select one, or use Tab and the arrow keys.`;
}
