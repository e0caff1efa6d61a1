/** What is wished of an insertion: its length, postures that it passes, hands and feet that stay. */

import { html, useEffect, useLayoutEffect, useRef, useState } from "../vendor/htm-preact-standalone.js";
import { NumberField } from "../shell/fields.js";
import { plain } from "./blocks.js";
import { lasting, LONGEST, SHORTEST } from "./items.js";

const HOLDS = {
  start: "stays as at the start",
  end: "is at once as at the end",
  throughout: "stays all the way",
  place: "stays in its place",
};
const LEAST = 0.1; // seconds that something stays in its place at least

/** @param {{does: any, studio: any, seam: any, joints: string[], thumbnail: any, onClose: () => void}} props */
export function WishSheet({ does, studio, seam, joints, thumbnail, onClose }) {
  const { ask } = seam;
  const element = useRef(null);
  const postures = usePostures(studio);
  const [posture, setPosture] = useState("");
  const [joint, setJoint] = useState("");
  const [hold, setHold] = useState("start");
  const [stay, setStay] = useState(() => stayFrom(seam, does.time));
  // At once: a key that comes before would act on the tracks, and close the sheet again.
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
    ${locked && html`<p class="said warning">It is locked: unlock it to ask for something else.</p>`}
    <label class="row">
      <span class="grow">Seconds</span>
      <${NumberField}
        min=${SHORTEST}
        max=${LONGEST}
        step="0.1"
        placeholder="as usual"
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
    <div class="stack">
      <h3>Passes these postures</h3>
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
        <button class="button" data-testid="wish-posture-add" disabled=${locked} onClick=${addPosture}>Pass</button>
      </div>
    </div>
    <div class="stack">
      <h3>Hands and feet that stay</h3>
      <${Wished}
        rows=${ask.pins.map((pin) => ({
          key: pin.joint,
          words: `${plain(pin.joint)} ${HOLDS[pin.hold]}${pin.hold === "place" ? fromTo(pin, seam) : ""}`,
          label: `Let go of the ${plain(pin.joint)}`,
        }))}
        action="Let go"
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
          ${joints.map((name) => html`<option key=${name} value=${name}>${plain(name)}</option>`)}
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
        <button class="button" data-testid="wish-pin-add" disabled=${locked} onClick=${addPin}>Pin</button>
      </div>
      ${hold === "place" && html`<${Stay} seam=${seam} stay=${stay} locked=${locked} onStay=${setStay} />`}
    </div>
  </section>`;
}

/** From when to when a hand or foot stays in its place. */
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
  const gap = Math.min(LEAST / seam.seconds, 0.5);
  return html`<div class="row" role="group" aria-label="How long it stays">
    ${field("begins", "from", 0, stay.ends - gap)} ${field("ends", "to", stay.begins + gap, 1)}
    <span class="hint">of ${seam.seconds.toFixed(1)} s</span>
  </div>`;
}

/** All of an insertion, or from the moment in it that is shown. @param {import("./items.js").Seam} seam */
function stayFrom({ at, seconds }, time) {
  const share = (time - at) / seconds;
  return { begins: share > 0 && share < 0.9 ? share : 0, ends: 1 };
}

/** From when to when something stays, in words. @param {import("./items.js").Pin} pin @param {import("./items.js").Seam} seam */
function fromTo({ begins, ends }, { seconds }) {
  return begins === 0 && ends === 1 ? "" : `, ${(begins * seconds).toFixed(1)} to ${(ends * seconds).toFixed(1)} s`;
}

/** A list of what is wished, each with a button that takes it back. */
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

/** Named postures of the corpus, and saved ones: [{key, name}]. */
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
