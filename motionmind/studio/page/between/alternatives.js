/** Alternatives side by side, in step: how good and how usual each is, and where the corpus shows each joint. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { thumbnail } from "../places.js";
import { awaited } from "../store.js";
import { useChange, useKeys } from "../shell/hooks.js";
import { icon } from "../shell/icons.js";
import { deskOf, MAX_ALTERNATIVES } from "./desk.js";
import { Elapsed } from "./elapsed.js";
import { Film } from "./film.js";
import { Joints, seenWords, jointName } from "./joints.js";
import { CLICK_SLACK_PX, Quartet } from "./quartet.js";
import { Steps } from "./steps.js";

const GROUP = "Alternatives";
const SPREADS = /** @type {const} */ (["near", "usual", "far"]);
const SPREAD_WORDS = { near: "nearer: variants of the first", usual: "usual: other passages of the corpus", far: "farther: as different as possible" };
const ZOOM_RATIO = 0.95;

/** @param {{studio: any}} props */
export function Centre({ studio }) {
  const desk = deskOf(studio);
  const shown = useChange(desk, () => desk.shown);
  useEffect(() => {
    studio.viewer.covered = shown;
    return () => (studio.viewer.covered = false);
  }, [shown]);
  return shown ? html`<${Alternatives} studio=${studio} />` : html`<${Steps} studio=${studio} />`;
}

/** @param {{studio: any}} props */
function Alternatives({ studio }) {
  const desk = deskOf(studio);
  const { theme } = studio.viewer;
  const found = useChange(desk, () => desk.found);
  const state = useChange(desk, () => desk.state);
  const words = useChange(desk, () => desk.words);
  const getting = useChange(studio.store, () => awaited(studio.store));
  const chosen = useChange(desk, () => desk.chosen);
  const dark = useChange(theme, () => theme.dark);
  const [quartet, setQuartet] = useState(/** @type {Quartet | null} */ (null));
  const section = useRef(/** @type {any} */ (null));
  // Return the focus to the gallery on closing.
  useLayoutEffect(() => {
    const before = /** @type {HTMLElement | null} */ (document.activeElement);
    return () => {
      if (section.current?.contains(document.activeElement) || document.activeElement === document.body) before?.focus();
    };
  }, []);
  useEffect(() => {
    const made = new Quartet(theme.dark);
    setQuartet(made);
    return () => made.end();
  }, []);
  useEffect(() => quartet?.colour(dark), [quartet, dark]);
  useEffect(() => {
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    quartet?.take(found.map(({ motion }) => motion), still);
  }, [quartet, found]);
  const accept = () => desk.accept();
  useKeys(studio, [
    { keys: [" "], does: "play or pause all", group: GROUP, act: () => quartet?.player.toggle() },
    ...Array.from({ length: MAX_ALTERNATIVES }, (_, i) => ({
      keys: [String(i + 1)],
      does: `choose alternative ${i + 1}`,
      group: GROUP,
      act: () => {
        desk.choose(i);
        document.getElementById(`alternative-${i}`)?.focus(); // there Enter accepts, and arrow keys go from joint to joint
      },
    })),
    { keys: ["Enter"], does: "accept the chosen one", group: GROUP, act: accept },
    { keys: ["Escape"], does: "back to the viewer", group: GROUP, act: () => desk.show(false) },
  ]);
  const searching = state === "searching";
  return html`<section ref=${section} class="centre alternatives" data-testid="alternatives" data-state=${state} aria-label="Alternatives" aria-busy=${String(searching)}>
    <header class="row">
      <h2 class="grow">${desk.away ? "Not searched yet" : heading(state, found.length)}</h2>
      <p class="hint" role="status">${searching && words && getting ? `${getting}. The search starts then.` : words}</p>
      ${searching && html`<${Elapsed} since=${desk.since} /><button class="button" onClick=${() => desk.stop()}>Cancel</button>`}
      <${Spread} desk=${desk} />
      <button class="button quiet icon" aria-label="Back to the viewer" title="Back to the viewer (Esc)" onClick=${() => desk.show(false)}>
        ${icon("close")}
      </button>
    </header>
    ${state === "failed" && !desk.away && html`<p class="empty">No movement joins these postures. Try another posture or duration.</p>`}
    <div class="four" role="radiogroup" aria-label="Alternatives" hidden=${state === "failed"}>
      ${Array.from({ length: state === "found" ? found.length : MAX_ALTERNATIVES }, (_, i) =>
        found[i]
          ? html`<${Alternative} key=${i} desk=${desk} quartet=${quartet} index=${i} chosen=${chosen === i} account=${found[i].account} motion=${found[i].motion} job=${found[i].job} />`
          : html`<${Waiting} key=${i} ends=${searching ? desk.ends : {}} begun=${!words} />`,
      )}
    </div>
    <p class="hint chosen-words">${summary(found[chosen]?.account)}</p>
    <footer class="row">
      ${quartet && html`<${Play} quartet=${quartet} ready=${found.length > 0} />`}
      <button class="button primary" data-testid="accept" disabled=${!found[chosen]} title="Add it to the time line (Enter)" onClick=${accept}>
        ${icon("check")} Accept ${found.length > 1 ? chosen + 1 : ""}
      </button>
    </footer>
  </section>`;
}

/** The dial for the next four: how far they go from the best movement. @param {{desk: any}} props */
function Spread({ desk }) {
  const spread = /** @type {"near" | "usual" | "far"} */ (useChange(desk, () => desk.spread));
  return html`<label class="spread" title="How far the others go from the first">
    <span>nearer</span>
    <input
      type="range"
      min="0"
      max=${SPREADS.length - 1}
      step="1"
      value=${SPREADS.indexOf(spread)}
      data-testid="spread"
      aria-label="How far the others go from the first"
      aria-valuetext=${SPREAD_WORDS[spread]}
      onChange=${(/** @type {any} */ event) => desk.go(SPREADS[Number(event.target.value)])}
    />
    <span>farther</span>
  </label>`;
}

/** The description of an alternative in one line, for small screens. @param {any} account */
function summary(account) {
  return account ? [account.differs, account.usual, account.sure, ...account.beyond].filter(Boolean).join("; ") : "";
}

/** A placeholder for an alternative to come: both its ends, pale. @param {any} props */
function Waiting({ ends, begun }) {
  const places = [ends.a, ends.b].filter(Boolean);
  return html`<div class="alternative card waiting">
    <div class="window">
      ${places.length > 0 && html`<div>${places.map(({ key, frame }) => html`<img src=${thumbnail(key, frame, 128)} alt="" />`)}</div>
        <span class="hint">${begun ? "searching…" : "waiting…"}</span>`}
    </div>
  </div>`;
}

/** @param {string} state @param {number} count */
function heading(state, count) {
  if (state === "failed") return "Nothing found";
  if (state === "searching") return "From A to B…";
  return count === 1 ? "From A to B: one movement" : html`From A to B: ${count}<span class="movements"> movements</span>`;
}

/** @param {any} props */
function Alternative({ desk, quartet, index, chosen, account, motion, job }) {
  const canvas = useRef(/** @type {any} */ (null));
  const [joint, setJoint] = useState(/** @type {number | null} */ (null));
  const time = useChange(quartet?.player ?? desk, () => (joint === null || !quartet ? 0 : Math.floor(quartet.player.time * 10) / 10));
  useEffect(() => {
    quartet?.onto(index, canvas.current);
    if (index === 0 && quartet) canvas.current.after(quartet.room);
  }, [quartet]);
  useEffect(() => quartet?.mark(index, joint), [quartet, joint]);
  const from = useRef(/** @type {{x: number, y: number, moved: boolean} | null} */ (null));
  const move = (/** @type {PointerEvent} */ event) => {
    if (!from.current) {
      if (event.pointerType === "mouse") setJoint(quartet?.jointAt(index, event.offsetX, event.offsetY) ?? null);
      return;
    }
    const { x, y } = from.current;
    if (!from.current.moved && Math.hypot(event.clientX - x, event.clientY - y) < CLICK_SLACK_PX) return;
    const { clientWidth, clientHeight } = canvas.current;
    quartet?.turn((event.clientX - x) / clientWidth, (event.clientY - y) / clientHeight);
    from.current = { x: event.clientX, y: event.clientY, moved: true };
  };
  const key = (/** @type {KeyboardEvent} */ event) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const count = motion.joints.length;
    if (by && !event.shiftKey) setJoint(((joint ?? (by > 0 ? -1 : count)) + by + count) % count);
    else if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
      const next = (index + (event.key === "ArrowRight" ? 1 : -1) + desk.found.length) % desk.found.length;
      desk.choose(next);
      document.getElementById(`alternative-${next}`)?.focus();
    } else if (event.key === " ") return;
    else if (event.key === "Enter") {
      if (!chosen) desk.choose(index);
      else desk.accept();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const name = joint === null ? "" : jointName(motion.joints[joint]);
  return html`<div class="alternative card ${chosen ? "chosen" : ""}">
    <div
      id="alternative-${index}"
      class="window"
      data-testid="alternative-${index + 1}"
      role="radio"
      aria-checked=${String(chosen)}
      aria-label="Alternative ${index + 1}: ${[account.words, account.differs].filter(Boolean).join("; ")}. Up and down arrows go from joint to joint."
      tabindex=${chosen ? 0 : -1}
      onClick=${() => !from.current?.moved && desk.choose(index)}
      onKeyDown=${key}
      onBlur=${() => setJoint(null)}
    >
      <canvas
        ref=${canvas}
        onPointerDown=${(/** @type {PointerEvent} */ event) => (from.current = { x: event.clientX, y: event.clientY, moved: false })}
        onPointerMove=${move}
        onPointerUp=${() => setTimeout(() => (from.current = null))}
        onPointerLeave=${() => {
          from.current = null;
          setJoint(null);
        }}
        onWheel=${(/** @type {WheelEvent} */ event) => {
          event.preventDefault();
          quartet?.zoom(event.deltaY < 0 ? ZOOM_RATIO : 1 / ZOOM_RATIO);
        }}
      ></canvas>
      <span class="number" aria-hidden="true">${chosen ? icon("check") : ""}${index + 1}</span>
      <p class="seen" role="status">${joint !== null && html`<strong>${name}</strong> ${seenWords(account.joints[name], time)}`}</p>
    </div>
    <${Film} job=${job} number=${account.number} motion=${motion} quartet=${quartet} />
    <div class="words">
      <p>${account.words}</p>
      ${account.differs && html`<p class="differs">${account.differs}</p>`}
      ${account.beyond.map((/** @type {string} */ line) => html`<p class="said warning">${icon("warning")}<span>${line}</span></p>`)}
      <${Joints} account=${account} point=${(/** @type {string | null} */ over) => setJoint(over === null ? null : motion.joints.findIndex((/** @type {string} */ one) => jointName(one) === over))} />
      <p class="hint">${account.usual}</p>
      <p class="hint">${account.sure}</p>
    </div>
  </div>`;
}

/** @param {{quartet: Quartet, ready: boolean}} props */
function Play({ quartet, ready }) {
  const { player } = quartet;
  const playing = useChange(player, () => player.playing);
  const line = useRef(/** @type {any} */ (null));
  useEffect(() => {
    const update = () => (line.current.value = String(player.motion.end ? player.time / player.motion.end : 0));
    update();
    player.addEventListener("change", update);
    return () => player.removeEventListener("change", update);
  }, [quartet]);
  return html`<button class="button icon" data-testid="play-alternatives" disabled=${!ready} aria-label=${playing ? "Pause all" : "Play all"} title="Play, pause (space)" onClick=${() => player.toggle()}>
      ${icon(playing ? "pause" : "play")}
    </button>
    <input
      ref=${line}
      class="grow"
      type="range"
      min="0"
      max="1"
      step="any"
      aria-label="Time of all alternatives"
      disabled=${!ready}
      onInput=${(/** @type {any} */ event) => {
        const share = Number(event.target.value); // before pausing, which resets the slider
        player.pause();
        player.seek(share * player.motion.end);
      }}
    />`;
}
