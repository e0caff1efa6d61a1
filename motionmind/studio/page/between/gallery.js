/** The gallery: named postures, frames of clips, and the user's own postures. */

import { html, useEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { useChange } from "../shell/hooks.js";
import { icon } from "../shell/icons.js";
import { movement } from "../movements.js";
import { thumbnail } from "../places.js";
import { insert, newId } from "../timeline/items.js";
import { walk } from "./arrows.js";
import { deskOf, POSTURE_TYPE, same } from "./desk.js";
import { Own } from "./own.js";

const MAX_LISTED = 24; // clips, until the user asks for all

/** @param {{studio: any}} props */
export function Gallery({ studio }) {
  const { store, api, act } = studio;
  const corpora = useChange(store, () => JSON.stringify(store.state?.corpora ?? null));
  const saved = useChange(store, () => store.state?.postures);
  const [gallery, setGallery] = useState(/** @type {any} */ (null));
  const [managing, manage] = useState(false);
  const [sought, seek] = useState("");
  const [reached, reach] = useState(""); // the key of the posture or clip that had the focus last
  useEffect(() => {
    if (corpora === "null") return; // not authorised yet
    const take = (/** @type {any} */ found) => {
      if (!found) return;
      setGallery(found);
      showFirst(studio, found);
      if (!found.whole) act(() => api.get("/api/gallery?whole")).then(take); // on a first start, clips take seconds
    };
    act(() => api.get("/api/gallery")).then(take);
  }, [corpora]);
  // Keys of movements do not change when a posture is renamed.
  const own = (saved ?? []).map((/** @type {any} */ { name, key }) => ({ key, title: name }));
  const fits = (/** @type {{title: string}} */ { title }) => title.toLowerCase().includes(sought.trim().toLowerCase());
  const listed = [own, ...(gallery?.corpora.flatMap((/** @type {any} */ one) => [one.postures, one.clips]) ?? [])].flat().filter(fits);
  const stop = (listed.find(({ key }) => key === reached) ?? listed[0])?.key; // where Tab enters
  return html`<section class="gallery" data-testid="gallery" aria-label="Gallery" onKeyDown=${walk}>
    ${managing && html`<${Own} key="own" studio=${studio} close=${() => manage(false)} />`}
    <label class="search">
      ${icon("search")}<span class="aside">Search postures and clips</span>
      <input class="field" type="search" placeholder="Search postures and clips" onInput=${(/** @type {any} */ event) => seek(event.target.value)} />
    </label>
    ${!gallery && html`<p class="hint" role="status">Loading the corpus…</p>`}
    ${gallery && own.some(fits) && html`<div class="row"><h3 class="grow">Your own</h3>
        <button class="button quiet" data-testid="manage-postures" aria-haspopup="dialog" onClick=${() => manage(true)}>Rename or delete</button></div>
      <${Postures} studio=${studio} postures=${own.filter(fits)} stop=${stop} reach=${reach} />`}
    ${gallery?.corpora.map(
      (/** @type {any} */ corpus) => html`
        ${corpus.postures.filter(fits).length > 0 && html`<h3>Postures of ${corpus.name}</h3>
          <${Postures} studio=${studio} postures=${corpus.postures.filter(fits)} stop=${stop} reach=${reach} />`}
        ${corpus.clips.filter(fits).length > 0 && html`<h3>Clips of ${corpus.name}</h3>
          <${Clips} studio=${studio} clips=${corpus.clips.filter(fits)} stop=${stop} reach=${reach} />`}
      `,
    )}
    ${gallery && !gallery.whole && html`<p class="hint" role="status">Composing the clips…</p>`}
    ${gallery && sought && !own.some(fits) && nothing(gallery, fits) && html`<p class="empty">No posture or clip is named “${sought}”.</p>`}
  </section>`;
}

/** Show the first posture on an empty stage. @param {any} studio @param {any} gallery */
async function showFirst(studio, gallery) {
  const first = [gallery.own, ...gallery.corpora.flatMap((/** @type {any} */ one) => [one.postures, one.clips])].flat()[0];
  if (!first || studio.viewer.motion || studio.store.state.piece.blocks.length > 0) return;
  const [motion] = await Promise.all([movement(studio.api, first.key), studio.pictured()]);
  const { viewer, store } = studio; // by now, a first stretch may be on its way there
  if (!viewer.motion && store.state.piece.blocks.length === 0) viewer.show(motion, { title: first.title });
}

/** @param {any} gallery @param {(one: any) => boolean} fits */
function nothing(gallery, fits) {
  return !gallery.corpora.flatMap((/** @type {any} */ corpus) => [...corpus.postures, ...corpus.clips]).some(fits);
}

/** @param {{studio: any, postures: {key: string, title: string}[], stop?: string, reach: (key: string) => void}} props */
function Postures({ studio, postures, stop, reach }) {
  const desk = deskOf(studio);
  const choice = useChange(desk, () => desk.choice);
  const ends = useChange(desk, () => desk.ends);
  return html`<ul class="thumbs">
    ${postures.map(({ key, title }) => {
      const place = { key, frame: 0, title };
      const marks = [...(ends.a && same(ends.a, place) ? ["A"] : []), ...(ends.b && same(ends.b, place) ? ["B"] : [])];
      return html`<li key=${key}>
        <button
          class="thumb"
          data-testid="posture-${title}"
          aria-pressed=${String(Boolean(choice && same(choice, place)))}
          title=${title}
          tabindex=${key === stop ? 0 : -1}
          onFocus=${() => reach(key)}
          draggable="true"
          onDragStart=${(/** @type {DragEvent} */ event) => event.dataTransfer?.setData(POSTURE_TYPE, JSON.stringify(place))}
          onClick=${() => pick(studio, place)}
        >
          <img src=${thumbnail(key, 0)} alt="" loading="lazy" draggable="false" />
          <span class="cut">${title}</span>
          ${marks.map((mark) => html`<span class="mark">${mark}<span class="aside"> is this posture</span></span>`)}
        </button>
      </li>`;
    })}
  </ul>`;
}

let added = 0; // how often something was added to the time line, which the viewer then shows

/** Pick a posture, and show it. @param {any} studio @param {any} place */
async function pick(studio, place) {
  const desk = deskOf(studio);
  desk.pick(place);
  if (desk.shown) return;
  const before = added;
  const motion = await studio.act(() => movement(studio.api, place.key));
  if (motion && desk.choice === place && added === before) studio.viewer.show(motion, { time: motion.times[place.frame], title: place.title });
}

/** @param {{studio: any, clips: any[], stop?: string, reach: (key: string) => void}} props */
function Clips({ studio, clips, stop, reach }) {
  const [open, setOpen] = useState("");
  const [all, setAll] = useState(false);
  return html`<ul class="clips">
      ${(all ? clips : clips.slice(0, MAX_LISTED)).map(
        (clip) => html`<li key=${clip.key} class=${clip.key === open ? "card" : ""}>
          <button
            class="clip"
            data-testid="clip-${clip.title}"
            aria-expanded=${String(clip.key === open)}
            title=${clip.about}
            tabindex=${clip.key === stop ? 0 : -1}
            onFocus=${() => reach(clip.key)}
            draggable="true"
            onDragStart=${(/** @type {DragEvent} */ event) => event.dataTransfer?.setData(POSTURE_TYPE, JSON.stringify(whole(clip)))}
            onClick=${() => setOpen(clip.key === open ? "" : clip.key)}
          >
            <img src=${thumbnail(clip.key, clip.frames >> 1, 64)} alt="" loading="lazy" draggable="false" />
            <span class="grow"><span class="cut">${clip.title}</span><span class="hint cut">${clip.about}</span></span>
            <span class="hint numbers">${clip.seconds.toFixed(0)} s</span>
          </button>
          ${clip.key === open && html`<${Frames} studio=${studio} clip=${clip} />`}
        </li>`,
      )}
    </ul>
    ${
      !all &&
      clips.length > MAX_LISTED &&
      html`<button class="button" onClick=${() => setAll(true)}>All ${clips.length} clips</button>`
    }`;
}

/** All frames of a clip, for a drag. @param {any} clip */
function whole({ key, frames, title }) {
  return { key, frame: 0, last: frames - 1, title };
}

/**
 * Add a posture, or the frames of a clip up to `last`, to the end of the time line.
 * @param {any} studio
 * @param {{key: string, frame: number, last?: number}} place
 */
export async function append(studio, place) {
  added++;
  const edit = insert(newId(studio.window), place);
  if (await studio.once(`append ${JSON.stringify(place)}`, () => studio.api.edit(edit))) studio.viewer.back();
}

/** A slider for a clip's frames, which the viewer shows. @param {{studio: any, clip: any}} props */
function Frames({ studio, clip }) {
  const desk = deskOf(studio);
  const { viewer } = studio;
  const [frame, setFrame] = useState(0);
  const motion = useRef(/** @type {any} */ (null));
  const wanted = useRef(-1); // the frame wanted before the movement loaded
  const taken = useRef(false); // whether the whole clip was added before that
  const place = (/** @type {number} */ at) => ({ key: clip.key, frame: at, title: `${clip.title} ${at}` });
  useEffect(() => {
    let here = true;
    desk.show(false);
    studio.act(() => movement(studio.api, clip.key)).then((/** @type {any} */ found) => {
      if (!here || !found) return;
      motion.current = found;
      if (desk.shown || taken.current) return; // the user was quicker
      const isWanted = wanted.current >= 0;
      viewer.show(found, { time: isWanted ? found.times[wanted.current] : found.start, title: clip.title, play: !isWanted });
    });
    const follow = () => viewer.motion === motion.current && setFrame(viewer.player.frame);
    viewer.player.addEventListener("change", follow);
    return () => {
      here = false;
      viewer.player.removeEventListener("change", follow);
    };
  }, []);
  const seek = (/** @type {any} */ event) => {
    const at = Number(event.target.value);
    setFrame(at);
    wanted.current = at;
    if (!motion.current) return;
    if (viewer.motion !== motion.current) viewer.show(motion.current, { title: clip.title });
    viewer.player.pause();
    viewer.player.seek(motion.current.times[at]);
  };
  const set = (/** @type {"a" | "b"} */ end) => {
    viewer.player.pause();
    desk.choice = place(frame);
    desk.set(end, place(frame));
  };
  return html`<div class="frames">
    <input
      type="range"
      min="0"
      max=${clip.frames - 1}
      value=${frame}
      aria-label="Frame of ${clip.title}"
      aria-valuetext="frame ${frame} of ${clip.frames - 1}"
      data-testid="frames"
      onInput=${seek}
    />
    <div class="row">
      <span
        class="hint numbers grow moment"
        data-testid="moment"
        draggable="true"
        title="Drag this frame to A, B or the time line"
        onDragStart=${(/** @type {DragEvent} */ event) => event.dataTransfer?.setData(POSTURE_TYPE, JSON.stringify(place(frame)))}
        >⠿ frame ${frame} of ${clip.frames - 1}</span
      >
      <button class="button" onClick=${() => set("a")}>As A</button>
      <button class="button" onClick=${() => set("b")}>As B</button>
    </div>
    <button class="button" data-testid="insert-clip" onClick=${() => {
      taken.current = true;
      append(studio, whole(clip));
    }}>Add the clip to the time line</button>
  </div>`;
}
