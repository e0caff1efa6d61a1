/** Wishes for an insertion: its duration, postures to pass, hands and feet to hold. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { Reaches } from "../asks/reaches.js";
import { TravelFields } from "../asks/travel.js";
import { countOf, timeOf } from "../music/beats.js";
import { NumberField } from "../shell/fields.js";
import { limbName } from "./blocks.js";
import { lasting, lengthOf, LONGEST, SHORTEST } from "./items.js";

const HOLDS = {
  start: "keeps its start",
  end: "takes its end at once",
  throughout: "never moves",
  place: "stays in place",
};
const MIN_STAY_S = 0.1;

/** @param {{does: any, studio: any, seam: any, joints: string[], thumbnail: any, onClose: () => void}} props */
export function WishSheet({ does, studio, seam, joints, thumbnail, onClose }) {
  const { ask } = seam;
  const element = useRef(null);
  const postures = usePostures(studio);
  const [posture, setPosture] = useState("");
  const [joint, setJoint] = useState("");
  const [hold, setHold] = useState("start");
  const [stay, setStay] = useState(() => stayFrom(seam, does.time));
  // Before the next key, which would act on the tracks and close the sheet.
  useLayoutEffect(() => element.current.querySelector("input").focus(), []);
  const locked = seam.decision === "locked";
  const escape = (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    onClose();
  };
  const without = (list, index) => list.filter((_, i) => i !== index);
  const addPosture = () => {
    if (posture) does.wish(seam, ({ passing }) => ({ passing: [...passing, { posture, frame: 0 }] }));
    setPosture("");
  };
  const addPin = () => {
    const { begins, ends } = hold === "place" ? stay : { begins: 0, ends: 1 };
    if (joint) does.wish(seam, ({ pins }) => ({ pins: [...pins, { joint, hold, begins, ends }] }));
    setJoint("");
  };
  return html`<section
    class="wish-sheet card stack"
    ref=${element}
    role="dialog"
    aria-label="Wishes for this insertion"
    data-testid="wish-sheet"
    onKeyDown=${escape}
  >
    <div class="row">
      <h3 class="grow">Wishes for this insertion</h3>
      <button class="button quiet" onClick=${onClose} data-testid="wishes-close">Close</button>
    </div>
    ${locked && html`<p class="said warning">This insertion is locked: unlock it to change the wishes.</p>`}
    <label class="row">
      <span class="grow">Seconds</span>
      <${NumberField}
        min=${SHORTEST}
        max=${LONGEST}
        step="0.1"
        placeholder="auto"
        data-testid="wish-seconds"
        disabled=${locked}
        value=${ask.seconds ?? ""}
        use=${(given) => {
          const seconds = given > 0 ? lasting(seam, given).seconds : null;
          does.wish(seam, () => ({ seconds }));
          return seconds;
        }}
      />
    </label>
    <${Landing} does=${does} seam=${seam} locked=${locked} />
    <div class="stack">
      <h3>Postures to pass</h3>
      <${Wished}
        rows=${ask.passing.map((one, i) => ({
          key: one.posture,
          picture: thumbnail(one.posture, one.frame),
          words: postures.find(({ key }) => key === one.posture)?.name ?? nameOf(one),
          label: `Remove posture ${i + 1}`,
        }))}
        action="Remove"
        locked=${locked}
        onAction=${(index) => does.wish(seam, () => ({ passing: without(ask.passing, index) }))}
      />
      <div class="row">
        <select
          class="grow"
          aria-label="Posture to pass"
          data-testid="wish-posture"
          value=${posture}
          disabled=${locked}
          onChange=${(event) => setPosture(event.target.value)}
        >
          <option value="">a posture…</option>
          ${postures.map(({ key, name }) => html`<option key=${key} value=${key}>${name}</option>`)}
        </select>
        <button class="button" data-testid="wish-posture-add" disabled=${locked} onClick=${addPosture}>Add</button>
      </div>
    </div>
    <div class="stack">
      <h3>Hands and feet to hold</h3>
      <${Wished}
        rows=${ask.pins.map((pin) => ({
          key: pin.joint,
          words: `${limbName(pin.joint)} ${HOLDS[pin.hold]}${pin.hold === "place" ? fromTo(pin, seam) : ""}`,
          label: `Release the ${limbName(pin.joint)}`,
        }))}
        action="Release"
        locked=${locked}
        onAction=${(index) => does.wish(seam, () => ({ pins: without(ask.pins, index) }))}
      />
      <div class="row">
        <select
          class="grow"
          aria-label="Hand or foot"
          data-testid="wish-joint"
          value=${joint}
          disabled=${locked}
          onChange=${(event) => setJoint(event.target.value)}
        >
          <option value="">a hand or foot…</option>
          ${joints.map((name) => html`<option key=${name} value=${name}>${limbName(name)}</option>`)}
        </select>
        <select
          class="grow"
          aria-label="How it stays"
          data-testid="wish-hold"
          value=${hold}
          disabled=${locked}
          onChange=${(event) => setHold(event.target.value)}
        >
          ${Object.entries(HOLDS).map(([value, words]) => html`<option key=${value} value=${value}>${words}</option>`)}
        </select>
        <button class="button" data-testid="wish-pin-add" disabled=${locked} onClick=${addPin}>Hold</button>
      </div>
      ${hold === "place" && html`<${Stay} seam=${seam} stay=${stay} locked=${locked} onStay=${setStay} />`}
    </div>
    <div class="stack">
      <h3>Places for hands and feet</h3>
      <${Reaches} studio=${studio} reaches=${ask.reaches} seconds=${lengthOf(seam)} locked=${locked}
        onChange=${(change) => does.wish(seam, ({ reaches }) => ({ reaches: change(reaches) }))} />
    </div>
    <div class="stack">
      <h3>Path over the floor</h3>
      <${TravelFields} travel=${ask.travel} locked=${locked}
        onChange=${(change) => does.wish(seam, ({ travel }) => ({ travel: change(travel) }))} />
    </div>
  </section>`;
}

/** The time and the count at which the insertion ends. */
function Landing({ does, seam, locked }) {
  const { meter } = does;
  const end = seam.at + lengthOf(seam);
  const field = (name, words, first, value, timeAt) => html`<label class="hold row">
    ${words}
    <${NumberField}
      min=${first}
      step=${name === "time" ? 0.1 : 1}
      aria-label=${`Lands at ${words}`}
      data-testid=${`wish-${name}`}
      disabled=${locked}
      value=${Number(value.toFixed(2))}
      use=${(given) => {
        does.land(seam, timeAt(given));
        return given;
      }}
    />
  </label>`;
  return html`<div class="row" role="group" aria-label="Lands at" title="As long as nothing earlier changes">
    <span class="grow">Lands at</span> ${field("time", "second", 0, end, (given) => given)}
    ${field("count", "count", 1, countOf(end, meter) + 1, (given) => timeOf(given - 1, meter))}
  </div>`;
}

/** The times between which a hand or foot stays in place. */
function Stay({ seam, stay, locked, onStay }) {
  const field = (name, words, least, most) => html`<label class="row">
    ${words}
    <${NumberField}
      min=${(least * seam.seconds).toFixed(1)}
      max=${(most * seam.seconds).toFixed(1)}
      step="0.1"
      aria-label=${`${words}, seconds`}
      data-testid=${`wish-${name}`}
      disabled=${locked}
      value=${(stay[name] * seam.seconds).toFixed(1)}
      use=${(given) => {
        const share = Math.min(Math.max(given / seam.seconds, least), most);
        onStay({ ...stay, [name]: share });
        return (share * seam.seconds).toFixed(1);
      }}
    />
  </label>`;
  const gap = Math.min(MIN_STAY_S / seam.seconds, 0.5);
  return html`<div class="row" role="group" aria-label="How long it stays">
    ${field("begins", "from", 0, stay.ends - gap)} ${field("ends", "to", stay.begins + gap, 1)}
    <span class="hint">of ${seam.seconds.toFixed(1)} s</span>
  </div>`;
}

/** The whole insertion, or from the current time in it. @param {import("./items.js").Seam} seam */
function stayFrom({ at, seconds }, time) {
  const share = (time - at) / seconds;
  return { begins: share > 0 && share < 0.9 ? share : 0, ends: 1 };
}

/** The times between which it stays, in words. @param {import("./items.js").Pin} pin @param {import("./items.js").Seam} seam */
function fromTo({ begins, ends }, { seconds }) {
  return begins === 0 && ends === 1 ? "" : `, ${(begins * seconds).toFixed(1)} to ${(ends * seconds).toFixed(1)} s`;
}

/** A list of wishes, each with a button that removes it. */
function Wished({ rows, action, locked, onAction }) {
  return html`<ul class="wishes-list">
    ${rows.map(
      ({ key, picture, words, label }, i) => html`<li key=${`${i} ${key}`} class="row">
        ${picture && html`<img alt="" src=${picture} />`}
        <span class="grow cut">${words}</span>
        <button class="button" aria-label=${label} disabled=${locked} onClick=${() => onAction(i)}>${action}</button>
      </li>`,
    )}
  </ul>`;
}

/** Saved postures, and named ones of the corpora: [{key, name}]. */
function usePostures(studio) {
  const [postures, setPostures] = useState([]);
  useEffect(() => {
    let gone = false;
    studio.api
      .get("/api/gallery")
      .then((gallery) => {
        if (!gone) setPostures(named(gallery));
      })
      .catch((error) => studio.say(error.message, { kind: "error" }));
    return () => (gone = true);
  }, [studio]);
  return postures;
}

function named({ own = [], corpora = [] }) {
  return [...own, ...corpora.flatMap(({ postures }) => postures)].map(({ key, name, title }) => ({ key, name: name ?? title }));
}

function nameOf({ posture, frame }) {
  const name = posture.split("/").at(-1);
  return frame > 0 ? `${name}, frame ${frame}` : name;
}
