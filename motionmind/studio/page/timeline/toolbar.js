/** The bar above the tracks: actions on the selection, progress of smoothing, tempo and zoom. */

import { html } from "../vendor/htm-preact-standalone.js";
import { countOf, timeOf } from "../music/beats.js";
import { MusicButtons } from "../music/sheet.js";
import { NumberField } from "../shell/fields.js";
import { groupOf } from "./groups.js";
import { FASTEST, isPosture, LONGEST_HOLD, MOST_REPEATS, selected, SLOWEST } from "./items.js";
import { clock } from "./scale.js";

const COUNTS = Array.from({ length: 15 }, (_, i) => i + 2); // of a phrase
const ICONS = {
  snap: "M3 2v6a5 5 0 0 0 10 0V2h-3v6a2 2 0 0 1-4 0V2zM3 5h3M10 5h3",
  split: "M8 1v14M5 4 2 8l3 4M11 4l3 4-3 4",
  duplicate: "M5 5h9v9H5zM2 11V2h9",
  mirror: "M8 1v14M5 4v8L1 8zM11 4v8l4-4z",
  delete: "M2 4h12M6 4V2h4v2M4 4l1 10h6l1-10",
  locked: "M4 7h8v7H4zM6 7V5a2 2 0 0 1 4 0v2",
  open: "M4 7h8v7H4zM6 7V4a2 2 0 0 1 4-1",
  wishes: "M2 4h12M2 8h12M2 12h12M5 2v4M11 6v4M7 10v4",
  note: "M2 3h12v8H7l-3 3v-3H2z",
  out: "M3 8h10",
  in: "M3 8h10M8 3v10",
  fit: "M1 3v10M15 3v10M4 8h8M4 8l2-2M4 8l2 2M12 8l-2-2M12 8l-2 2",
};

function Icon({ name }) {
  return html`<svg viewBox="0 0 16 16" aria-hidden="true"><path d=${ICONS[name]} /></svg>`;
}

/** @param {{does: any, piece: any, selection: any, meter: import("./scale.js").Meter, snaps: boolean, stopped: boolean,
 *   onStop: (stopped: boolean) => void, sheet: boolean}} props */
export function Toolbar({ does, piece, selection, meter, snaps, stopped, onStop, sheet }) {
  const item = selected(piece, selection);
  const group = groupOf(piece, selection);
  return html`<div class="toolbar row" role="toolbar" aria-label="Time line">
    <h2 class="aside">Time line</h2>
    ${group.length > 1 && html`<${OfGroup} does=${does} group=${group} />`}
    ${item?.block && group.length === 1 && html`<${OfStretch} does=${does} block=${item.block} meter=${meter} />`}
    ${item?.seam && html`<${OfSeam} does=${does} seam=${item.seam} sheet=${sheet} />`}
    ${!item && html`<p class="hint grow cut">${hintFor(piece)}</p>`}
    <${Smoothing} piece=${piece} stopped=${stopped} onStop=${onStop} />
    ${piece.blocks.length > 0 && html`<${Button} icon="note" words="Note, marker or section at the playhead (N)" does=${() => does.note()} test="note" />`}
    <${Counting} does=${does} meter=${meter} snaps=${snaps} />
    <div class="zoom row">
      <${Button} icon="out" words="Zoom out (−)" does=${() => does.zoomOut()} test="zoom-out" />
      <${Button} icon="fit" words="Show the whole piece (0)" does=${() => does.fit()} test="zoom-fit" />
      <${Button} icon="in" words="Zoom in (+)" does=${() => does.zoomIn()} test="zoom-in" />
    </div>
  </div>`;
}

function OfGroup({ does, group }) {
  const [first, last] = [group[0], group[group.length - 1]];
  return html`<p class="grow cut" data-testid="selected">
      <b>${group.length} stretches</b>${" "}<span class="pale numbers">${clock(last.at + last.seconds - first.at)} s</span>
    </p>
    <${Button} icon="duplicate" words="Duplicate (D)" does=${() => does.duplicate()} test="duplicate" />
    <${Button} icon="mirror" words="Mirror (M)" does=${() => does.mirror()} test="mirror" />
    <${Button} icon="delete" words="Delete (Del)" does=${() => does.remove()} test="delete" />`;
}

/** Tempo and phrases, which the project keeps, and whether times snap to counts. */
function Counting({ does, meter, snaps }) {
  return html`<div class="tempo">
    <label title="Counts a minute">
      <span class="pale">♩=</span>
      <${NumberField}
        min="20"
        max="300"
        step="1"
        value=${meter.tempo}
        data-testid="tempo"
        aria-label="Tempo, counts a minute"
        use=${(given) => {
          const tempo = Math.min(Math.max(given || 120, 20), 300);
          does.count({ tempo });
          return tempo;
        }}
      />
    </label>
    <select
      data-testid="counts"
      aria-label="Counts of a phrase"
      title="Counts of a phrase"
      value=${meter.counts}
      onChange=${(event) => does.count({ counts: Number(event.target.value) })}
    >
      ${COUNTS.map((count) => html`<option value=${count}>${count}</option>`)}
    </select>
    <${MusicButtons} does=${does} />
    <${Button} icon="snap" words="Snap to counts (G)" pressed=${snaps} does=${() => does.snap()} test="snap" />
  </div>`;
}

function OfStretch({ does, block, meter }) {
  return html`<p class="grow cut" data-testid="selected">
      <b>${block.title}</b>${" "}<span class="pale numbers"
        >${block.mirrored ? "mirrored, " : ""}${clock(block.seconds)} s · ${framesOf(block)} of ${block.frames}</span
      >
    </p>
    ${isPosture(block)
      ? html`<${Hold} does=${does} block=${block} meter=${meter} />`
      : html`<${Played} does=${does} block=${block} />`}
    <${Button} icon="split" words="Split (S)" does=${() => does.split()} test="split" />
    <${Button} icon="duplicate" words="Duplicate (D)" does=${() => does.duplicate()} test="duplicate" />
    <${Button} icon="mirror" words="Mirror (M)" does=${() => does.mirror()} test="mirror" />
    <${Button} icon="delete" words="Delete (Del)" does=${() => does.remove()} test="delete" />`;
}

/** How fast a stretch plays, in percent, and how many times. */
function Played({ does, block }) {
  const field = (name, words, unit, rest, use) => html`<label class="hold row">
    <${NumberField} ...${rest} data-testid=${name} aria-label=${words} use=${use} />
    <span class="pale">${unit}</span>
  </label>`;
  const change = (fields) => does.play(() => fields, { block: block.id });
  const pace = { min: 100 * SLOWEST, max: 100 * FASTEST, step: 5, value: Number((100 * block.pace).toFixed(1)) };
  const repeats = { min: 1, max: MOST_REPEATS, step: 1, value: block.repeats };
  return html`<div class="row" role="group" aria-label="Pace and repeats" title="Pace (, .) and repeats (R)">
    ${field("pace", "Pace, percent of the recorded", "%", pace, (given) => {
      change({ pace: given / 100 });
      return given;
    })}
    ${field("repeats", "Times that it plays", "×", repeats, (given) => {
      change({ repeats: given });
      return given;
    })}
  </div>`;
}

function framesOf({ first, last }) {
  return first === last ? `frame ${first}` : `frames ${first} to ${last}`;
}

/** How long a posture is held, in seconds and in counts. */
function Hold({ does, block, meter }) {
  const from = countOf(block.at, meter);
  const field = (unit, words, value, secondsOf) => html`<label class="hold row">
    <${NumberField}
      min="0"
      max=${unit === "s" ? LONGEST_HOLD : countOf(block.at + LONGEST_HOLD, meter) - from}
      step=${unit === "s" ? 0.1 : 1}
      value=${Number(value.toFixed(2))}
      data-testid=${`hold-${unit}`}
      aria-label=${`Hold the posture, ${words}`}
      use=${(given) => {
        does.hold(block, secondsOf(given));
        return given;
      }}
    />
    <span class="pale">${unit}</span>
  </label>`;
  return html`<div class="row" role="group" aria-label="Hold" title="How long the body stands still (Shift ← →)">
    ${field("s", "seconds", block.hold, (given) => given)}
    ${field("counts", "counts", countOf(block.at + block.hold, meter) - from, (given) => timeOf(from + given, meter) - block.at)}
  </div>`;
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
        words=${locked ? "Unlock (U)" : "Lock (U)"}
        pressed=${locked}
        does=${() => does.lock()}
        test="lock"
      />
      <button class="button" data-testid="discard" onClick=${() => does.remove()}>
        ${decision === "discarded" ? "Restore" : "Discard"}
      </button>`}
    <${Button}
      icon="wishes"
      words="Wishes: duration, postures, hands and feet, path (W)"
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
