/** Variations: how far to depart, where to start, what to keep; the new order, and both side by side. */

import { html, useEffect, useMemo, useState } from "../vendor/htm-preact-standalone.js";
import { StaleError } from "../api.js";
import { movement } from "../movements.js";
import { perStudio, useChange } from "../shell/hooks.js";
import { Composed, Movements } from "../timeline/composed.js";
import { AttractorMap } from "./map.js";
import { Tiles } from "./tiles.js";
import { alike, departure, insertedShare, Varying } from "./varying.js";

const MAX_DEPARTURE = 0.4; // share of the steps: no attractor departs farther
const DEPARTURE_SLACK = 0.06; // a variation that departs less than the wish by this cannot depart farther
const STRETCHES = [1, 2, 4, 8]; // postures
const EDIT_DELAY_MS = 150; // from an edit of the piece to its new variation
const MAX_RETRIES = 5; // if another window edits the piece meanwhile
const INSERTED = [
  [0.5, "half the time"],
  [0.3, "three tenths"],
  [0.2, "a fifth"],
  [0.1, "a tenth"],
];
const FLOWS = [
  ["lorenz", "Lorenz"],
  ["rossler", "Rössler"],
];
const varyingOf = perStudio((studio) => new Varying(studio.api));

/** @param {{studio: any}} props */
export function Panel({ studio }) {
  const varying = useMemo(() => varyingOf(studio), [studio]);
  useChange(varying, () => varying.version);
  const piece = useChange(studio.store, () => studio.store.state?.piece);
  const view = useView(studio, varying, piece);
  const frames = piece?.blocks.reduce((/** @type {number} */ sum, /** @type {any} */ block) => sum + block.last - block.first + 1, 0) ?? 0;
  const isLong = frames > 2;
  useEffect(() => {
    if (!isLong) return undefined;
    // A changed piece needs a new variation; but show the edit first.
    const asking = setTimeout(() => varying.ask(), varying.proposal ? EDIT_DELAY_MS : 0);
    return () => clearTimeout(asking);
  }, [piece]);
  if (!isLong) {
    return html`<section class="stack vary">
      <h2>Variations</h2>
      <p class="empty">A variation puts the piece's stretches in another order. The piece is too short: add a clip to the time line,
      whole or in part.</p>
      <div class="row">
        <button class="button" onClick=${() => studio.open("between")}>Choose a clip</button>
        <button class="button" onClick=${() => studio.open("movement")}>Use your own</button>
      </div>
    </section>`;
  }
  const { wish, proposal, error } = varying;
  const isPiece = Boolean(proposal) && alike(proposal.piece.blocks, piece.blocks);
  const shown = isPiece ? piece : proposal?.piece;
  const departs = proposal ? departure(proposal.departs) : "";
  const isFarthest = Boolean(proposal) && !varying.asking && wish.nudge === null && wish.depart > proposal.departs + DEPARTURE_SLACK;
  const label = isFarthest ? `${departs} at most` : departs;
  const make = async () => {
    // Wait for edits under way, and for any made meanwhile: the variation must include them.
    for (let changed; changed !== studio.api.changed; ) {
      ({ changed } = studio.api);
      await changed;
      await varying.ask();
    }
    if (varying.proposal && !varying.error) await studio.api.arrange(varying.edit, varying.proposal.basis);
  };
  const makeOfLatest = async (retries = MAX_RETRIES) => {
    try {
      await make();
      if (retries < MAX_RETRIES) studio.say("Another window edited the piece: this is a variation of the edited piece.");
    } catch (wrong) {
      if (!(wrong instanceof StaleError) || !retries) throw wrong;
      await makeOfLatest(retries - 1); // another window was quicker
    }
  };
  const vary = () => studio.once("vary", makeOfLatest);
  return html`<section class="stack vary">
    <h2>Variations</h2>
    <${AttractorMap} studio=${studio} varying=${varying} piece=${shown} playing=${view.playing} />
    <label class="dial">
      <span class="row"><span class="grow">How far to depart</span>
      <output data-testid="departs" class="pale">${label}</output></span>
      <input type="range" data-testid="depart" min="0" max=${MAX_DEPARTURE * 100} step="1" value=${Math.round(wish.depart * 100)}
        aria-valuetext=${label}
        onInput=${(/** @type {any} */ event) => varying.want({ depart: Number(event.target.value) / 100 })} />
    </label>
    <label class="row"><span class="grow">Insertions take at most</span>
      <select data-testid="inserted" value=${wish.inserted ?? ""} title="The engine's estimate, before the search"
        onChange=${(/** @type {any} */ event) => varying.want({ inserted: Number(event.target.value) || null })}>
        <option value="">no limit</option>
        ${INSERTED.map(([share, words]) => html`<option value=${share}>${words}</option>`)}
      </select>
    </label>
    ${proposal?.unlimited && html`<p class="hint" role="status" data-testid="unlimited">${proposal.unlimited}</p>`}
    <div class="row">
      <button class="button primary" data-testid="vary" disabled=${!proposal || isPiece} title="Make this order the piece" onClick=${vary}>Vary</button>
      <button class="button" data-testid="another" disabled=${!proposal} title="Start elsewhere on the attractor" onClick=${() => varying.another()}>Another</button>
      <button class="button" data-testid="beside" aria-pressed=${view.beside} title="Show the original and the variation side by side"
        onClick=${view.toggle}>Compare</button>
    </div>
    ${!proposal && !error && html`<p class="hint" role="status">Laying out the piece on the attractor…</p>`}
    ${error && html`<p class="said error" role="alert" data-testid="vary-error">${error}</p>`}
    ${shown && html`<${Order} studio=${studio} varying=${varying} shown=${shown} isPiece=${isPiece} view=${view} />`}
    <${Details} varying=${varying} />
  </section>`;
}

/** @param {{studio: any, varying: Varying, shown: any, isPiece: boolean, view: any}} props */
function Order({ studio, varying, shown, isPiece, view }) {
  const count = shown.blocks.length;
  const { wish, proposal } = varying;
  const selected = useChange(studio.store, () => studio.store.selection?.block);
  const waiting = shown.seams.filter((/** @type {any} */ seam) => seam.state === "waiting" || seam.state === "abrupt").length;
  const locked = proposal?.locked ?? [];
  return html`<div class="stack">
    <div class="row">
      <h3 class="grow" aria-live="polite" data-testid="length">${count} stretch${count === 1 ? "" : "es"}, ${lengthOf(shown, waiting ? proposal?.forecast : null, waiting)}${
        isPiece && waiting ? ` · ${waiting} seam${waiting > 1 ? "s" : ""} to smooth` : ""
      }${isPiece ? " · this is the piece" : ""}</h3>
      ${wish.kept.length + wish.stay.length > 0 &&
      html`<button class="button quiet" data-testid="let-go" onClick=${() => varying.letGo()}>Release all</button>`}
    </div>
    ${selected &&
    !varying.keeps(selected) &&
    html`<button class="button" data-testid="keep-selected" title="Keep the stretch selected on the time line in its place" onClick=${() => varying.stay(selected)}>Keep the selected stretch</button>`}
    <${Tiles} piece=${shown} kept=${proposal?.kept ?? []} locked=${locked}
      onKeep=${(/** @type {string} */ id) => varying.keep(id)} onPlay=${(/** @type {any} */ block) => view.look(block.at)} />
    <p class="hint">Keep what you like: it stays in place, and the rest varies.</p>
  </div>`;
}

/**
 * How long a variation lasts, with all its insertions: the forecast until they are found.
 * @param {any} piece @param {import("./varying.js").Forecast | null | undefined} forecast @param {number} waiting seams
 */
function lengthOf(piece, forecast, waiting) {
  const percent = (/** @type {number} */ share) => `${Math.round(100 * share)} % inserted`;
  if (forecast) {
    const { seconds, least, most, inserted } = forecast;
    const [from, to] = [Math.round(least), Math.round(most)];
    return `about ${seconds.toFixed(0)} s${from < to ? ` (${from} to ${to})` : ""} · about ${percent(inserted)}`;
  }
  return waiting ? `${piece.seconds.toFixed(0)} s and insertions` : `${piece.seconds.toFixed(0)} s · ${percent(insertedShare(piece))}`;
}

/** @param {{varying: Varying}} props */
function Details({ varying }) {
  const { wish, proposal } = varying;
  return html`<details class="details">
    <summary>Details</summary>
    <div class="stack">
      <label class="row"><span class="grow">Shortest stretch</span>
        <select data-testid="stretch" value=${wish.stretch}
          onChange=${(/** @type {any} */ event) => varying.want({ stretch: Number(event.target.value) })}>
          ${STRETCHES.map((count) => html`<option value=${count}>${count} posture${count > 1 ? "s" : ""}</option>`)}
        </select>
      </label>
      <label class="row"><span class="grow">Attractor</span>
        <select data-testid="flow" value=${wish.flow}
          onChange=${(/** @type {any} */ event) => varying.want({ flow: event.target.value, start: null })}>
          ${FLOWS.map(([name, words]) => html`<option value=${name}>${words}</option>`)}
        </select>
      </label>
      <div class="row"><span class="grow">Start</span>
        <span class="pale numbers">${wish.start ? wish.start.map((x) => x.toFixed(2)).join(", ") : "default"}</span>
        ${wish.start && html`<button class="button quiet" data-testid="usual-start" onClick=${() => varying.want({ start: null })}>Reset</button>`}
      </div>
      ${proposal &&
      html`<div class="row"><span class="grow">Nudge</span><span class="pale numbers">${proposal.nudge.toPrecision(3)}</span></div>
        <div class="row"><span class="grow">Steps that depart</span><span class="pale numbers">${(100 * proposal.departs).toFixed(1)} %</span></div>`}
      <p class="hint">The piece lies along the attractor. A second path, started a nudge beside it, passes the postures in another
      order: on a chaotic attractor the two part sooner or later.</p>
    </div>
  </details>`;
}

/**
 * The viewer's part: show the variation, or the original and the variation side by side.
 * @param {any} studio @param {Varying} varying @param {any} piece
 */
function useView(studio, varying, piece) {
  const [beside, setBeside] = useState(false);
  const [looking, setLooking] = useState(false);
  const movements = useMemo(() => new Movements((/** @type {string} */ key) => movement(studio.api, key)), [studio]);
  const { proposal } = varying;
  const isPiece = Boolean(proposal && piece && alike(proposal.piece.blocks, piece.blocks));
  const show = async (/** @type {number | undefined} */ time, /** @type {boolean} */ both) => {
    if (!proposal) return;
    const parts = isPiece ? piece.parts : proposal.piece.parts;
    const [own, original] = await Promise.all(
      [parts, proposal.original].map(async (some) => {
        await movements.load(some[0].key);
        const composed = new Composed(some, movements, "");
        await composed.load();
        return composed;
      }),
    );
    if (varying.proposal !== proposal) return; // a newer one has arrived
    const { viewer } = studio;
    const [before, now] = isPiece ? ["Before", "The piece"] : ["The piece", "The variation"];
    const how = both ? { beside: own, title: before, besideTitle: now } : { title: now };
    viewer.show(both ? original : own, { time, look: !looking, ...how });
  };
  const failed = (/** @type {Error} */ error) => studio.say(error.message, { kind: "error" });
  useEffect(() => {
    if (looking) show(undefined, beside).catch(failed);
  }, [proposal, piece, beside, looking]);
  useEffect(() => {
    studio.viewer.back(); // another panel may have left its movement there
    return () => studio.viewer.back();
  }, []);
  return {
    beside,
    playing: looking || isPiece,
    toggle: () => {
      setBeside(!beside);
      setLooking(!beside || looking);
    },
    look: (/** @type {number} */ time) => {
      setLooking(true);
      show(time, beside).catch(failed);
    },
  };
}
