/** The text of a score below the viewer: its lines and the playhead follow each other. */

import { html, useEffect, useMemo, useRef } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";
import { clock } from "../timeline/scale.js";
import { scoreOf } from "./panel.js";

const LINE_PX = 20; // as in scores.css
const PAD_PX = 8;

/** @param {{studio: any}} props */
export function Centre({ studio }) {
  const score = useMemo(() => scoreOf(studio), [studio]);
  const open = useChange(score, () => score.isOpen);
  return open ? html`<${Editor} studio=${studio} score=${score} />` : null;
}

/** @param {{studio: any, score: import("./score.js").Score}} props */
function Editor({ studio, score }) {
  const { viewer } = studio;
  const { player } = viewer;
  const field = useRef(/** @type {any} */ (null));
  const marks = useRef(/** @type {any} */ (null));
  const told = useRef(/** @type {any} */ (null));
  useChange(score, () => score.version);
  useEffect(() => {
    let shown = 0;
    const update = () => {
      const at = viewer.isHome ? score.linesAt(viewer.own) : null;
      for (const [name, line] of Object.entries({ line: at?.line ?? 0, call: at?.call ?? 0, wrong: score.wrong })) {
        const mark = marks.current.querySelector(`.${name}`);
        mark.hidden = line === 0;
        mark.style.transform = `translateY(${PAD_PX + (line - 1) * LINE_PX - field.current.scrollTop}px)`;
      }
      const words = at ? `line ${at.line}, ${clock(viewer.own)} s` : "";
      if (told.current.textContent !== words) told.current.textContent = words;
      if (at && at.line !== shown && document.activeElement !== field.current) reveal(field.current, at.call);
      shown = at?.line ?? 0;
    };
    update();
    const { current } = field;
    const heard = /** @type {[EventTarget, string][]} */ ([[player, "change"], [viewer, "show"], [score, "change"], [current, "scroll"]]);
    for (const [target, event] of heard) target.addEventListener(event, update);
    return () => {
      for (const [target, event] of heard) target.removeEventListener(event, update);
    };
  }, [score]);
  const go = () => {
    const time = score.timeOf(lineAt(field.current), viewer.own);
    if (time === null) return;
    viewer.back();
    player.pause();
    player.seek(viewer.clock(time));
  };
  const apply = () => score.apply();
  const key = (/** @type {KeyboardEvent} */ event) => {
    event.stopPropagation(); // the text needs its keys
    if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
    event.preventDefault();
    apply();
  };
  const composing = score.busy === "composing";
  return html`<section class="score" aria-label="Score" data-testid="score" aria-busy=${composing}>
    <header class="row">
      <strong class="cut">${score.of ? `Score of ${score.of}` : "Score of the piece"}</strong>
      <span class="grow pale numbers" data-testid="score-at" ref=${told}></span>
      <button class="button" data-testid="score-apply" title="Change the piece (Ctrl+Enter)" disabled=${composing || !score.isDraft} onClick=${apply}>
        ${composing ? "Composing…" : "Change the piece"}</button>
      <button class="button quiet" data-testid="score-close" onClick=${() => score.close()}>Close</button>
    </header>
    ${score.error && html`<p class="said error" role="alert" data-testid="score-error">${score.error}</p>`}
    <div class="sheet" ref=${marks}>
      <div class="mark call" hidden></div><div class="mark line" hidden></div><div class="mark wrong" hidden></div>
      <textarea ref=${field} wrap="off" spellcheck=${false} autocomplete="off" aria-label="Text of the score" data-testid="score-text"
        value=${score.text}
        onInput=${(/** @type {any} */ event) => score.edit(event.target.value)}
        onClick=${go}
        onKeyDown=${key}
        onKeyUp=${(/** @type {KeyboardEvent} */ event) => /^(Arrow(Up|Down)|Page|Home|End)/.test(event.key) && go()}></textarea>
    </div>
  </section>`;
}

/** The line of the caret, from 1; a continued line counts as its first. @param {HTMLTextAreaElement} field */
function lineAt({ value, selectionStart }) {
  const lines = value.slice(0, selectionStart).split("\n");
  const whole = value.split("\n");
  let line = lines.length;
  while (line > 1 && whole[line - 2].trimEnd().endsWith(",")) line -= 1;
  return line;
}

/** Scroll a line into sight. @param {HTMLTextAreaElement} field @param {number} line */
function reveal(field, line) {
  const top = (line - 1) * LINE_PX;
  if (top < field.scrollTop || top + 2 * LINE_PX > field.scrollTop + field.clientHeight) field.scrollTop = top - field.clientHeight / 2;
}
