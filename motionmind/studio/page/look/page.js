/** The page of the look-only link: the piece plays, and its notes are read and commented. */

import { html, useEffect, useMemo, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { Credits } from "../export/panel.js";
import { movement } from "../movements.js";
import { thumbnail } from "../places.js";
import { Everywhere, Offline } from "../shell/bar.js";
import { useKeys } from "../shell/hooks.js";
import { icon } from "../shell/icons.js";
import { View } from "../shell/stage.js";
import { Shown } from "../shell/toasts.js";
import { useStore } from "../store.js";
import { Movements } from "../timeline/composed.js";
import { EMPTY } from "../timeline/items.js";
import { anchorOf, noteFrom } from "../timeline/notes.js";
import { usePlayed } from "../timeline/panel.js";
import { clock } from "../timeline/scale.js";

const NAME = "motionmind-name"; // key in the browser's storage: the name under comments
const THUMBNAIL_HEIGHT_PX = 64;

/** @param {{studio: any}} props */
export function Looking({ studio }) {
  const piece = useStore(studio, ({ state }) => state?.piece) ?? EMPTY;
  const movements = useMemo(() => new Movements((key) => movement(studio.api, key)), [studio]);
  usePlayed(studio, movements, piece);
  return html`<${Bar} studio=${studio} />
    <main class="view" aria-label="Viewer"><${View} studio=${studio} /></main>
    <aside class="panel" aria-label="Comments">
      <div class="stack">
        <h2>Comments</h2>
        ${
          piece.blocks.length === 0
            ? html`<p class="empty">The piece is empty. When it has movement, it plays here.</p>`
            : html`<${Form} studio=${studio} piece=${piece} movements=${movements} />`
        }
        <${Notes} studio=${studio} piece=${piece} />
        ${piece.blocks.length > 0 && html`<${Credits} studio=${studio} />`}
      </div>
    </aside>
    <${Shown} toasts=${studio.toasts} />`;
}

/** @param {{studio: any}} props */
function Bar({ studio }) {
  const title = useStore(studio, ({ state }) => state?.title) || "Untitled";
  useEffect(() => void (document.title = `${title} · MotionMind studio`), [title]);
  return html`<header class="bar">
    <div class="brand">${icon("brand")}<span>MotionMind</span></div>
    <h1 class="cut" data-testid="title">${title}</h1>
    <span class="hint only">look and comment</span>
    <span class="space"></span>
    <${Offline} store=${studio.store} words="Not connected" />
    <${Everywhere} studio=${studio} />
  </header>`;
}

/** Write a comment on the moment in view. @param {{studio: any, piece: any, movements: Movements}} props */
function Form({ studio, piece, movements }) {
  const { player } = studio.viewer;
  const [author, setAuthor] = useState(() => localStorage.getItem(NAME) ?? "");
  const [text, setText] = useState("");
  const field = useRef(/** @type {any} */ (null));
  const moment = useRef(/** @type {any} */ (null));
  useEffect(() => {
    const follow = () => (moment.current.textContent = `${clock(studio.viewer.own)} s`);
    follow();
    player.addEventListener("change", follow);
    return () => player.removeEventListener("change", follow);
  }, []);
  useKeys(studio, [{ keys: ["n"], does: "write a comment on this moment", group: "Comments", act: () => field.current.focus() }]);
  const send = (/** @type {Event} */ event) => {
    event.preventDefault();
    studio.once("comment", async () => {
      const place = anchorOf(piece, studio.viewer.own, (block) => movements.at(block.key)?.times);
      studio.store.take(await studio.api.post("/api/comments", { author, text, ...place }));
      localStorage.setItem(NAME, author);
      setText("");
    });
  };
  const ready = author.trim() !== "" && text.trim() !== "";
  return html`<form class="stack write" onSubmit=${send}>
    <label>Your name
      <input class="field" data-testid="comment-name" maxlength="80" autocomplete="name" value=${author}
        onInput=${(/** @type {any} */ event) => setAuthor(event.target.value)} />
    </label>
    <label><span>Comment at <span ref=${moment} class="numbers" data-testid="comment-moment"></span></span>
      <input ref=${field} class="field" data-testid="comment-text" maxlength="500" autocomplete="off" value=${text}
        onFocus=${() => player.playing && player.pause()}
        onInput=${(/** @type {any} */ event) => setText(event.target.value)} />
    </label>
    <button class="button primary" data-testid="comment-send" disabled=${!ready}>Send</button>
  </form>`;
}

/** The notes in order, each a button that shows its moment. @param {{studio: any, piece: any}} props */
function Notes({ studio, piece }) {
  const { player } = studio.viewer;
  const list = useRef(/** @type {any} */ (null));
  const go = (/** @type {any} */ note) => {
    if (!note) return;
    if (player.playing) player.pause();
    player.seek(studio.viewer.clock(note.at));
    list.current?.querySelector(`[data-note="${note.id}"]`)?.scrollIntoView({ block: "nearest" });
  };
  useKeys(studio, [
    { keys: ["["], does: "go to the note before", group: "Comments", act: () => go(noteFrom(piece.notes, studio.viewer.own, -1)) },
    { keys: ["]"], does: "go to the note after", group: "Comments", act: () => go(noteFrom(piece.notes, studio.viewer.own, 1)) },
  ]);
  const blocks = new Map(piece.blocks.map((/** @type {any} */ block) => [block.id, block]));
  return html`<ul class="notes" ref=${list}>
    ${piece.notes.map((/** @type {any} */ note) => {
      const block = blocks.get(note.block);
      return html`<li key=${note.id}>
        <button class="card ${note.kind}" data-note=${note.id} data-testid=${`note-${note.id}`} onClick=${() => go(note)}>
          ${block && !block.missing && html`<img alt="" loading="lazy" src=${thumbnail(block.key, note.frame, THUMBNAIL_HEIGHT_PX)} />`}
          <span><b class="numbers">${clock(note.at)} s</b>${note.author && html` <b>${note.author}</b>`} ${note.text || "marker"}</span>
        </button>
      </li>`;
    })}
  </ul>`;
}
