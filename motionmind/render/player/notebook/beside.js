/** In a notebook: a stretch of time that can be selected, and what the page and the notebook tell each other. */

import "motionmind/main";

const OFTEN = 100; // milliseconds from one word of the time to the next, while it plays
const ROWS = [
  [["Shift", "drag"], "on the line of time: select a stretch"],
  [["["], "select from here on"],
  [["]"], "select up to here"],
  [["Esc"], "select nothing"],
];
const $ = (id) => document.getElementById(id);

/** The stretch of time that is selected; a player in it plays it alone. Fires "change". */
class Selection extends EventTarget {
  #stretch = null;

  /**
   * @param {HTMLElement} line the line of time
   * @param {Player} player
   */
  constructor(line, player) {
    super();
    this.player = player;
    this.band = document.createElement("div");
    Object.assign(this.band, { className: "selection", hidden: true });
    line.append(this.band);
    this.#drag(line);
    player.addEventListener("change", () => this.#stay());
  }

  /** [from, to] in seconds, or null. */
  get stretch() {
    return this.#stretch;
  }

  set stretch(stretch) {
    const { start, end } = this.player.motion;
    const inside = stretch?.map((time) => Math.min(Math.max(time, start), end)).sort((a, b) => a - b);
    this.#stretch = inside && inside[0] < inside[1] ? inside : null;
    this.band.hidden = !this.#stretch;
    if (this.#stretch) {
      const [left, right] = this.#stretch.map((time) => (100 * (time - start)) / (end - start));
      Object.assign(this.band.style, { left: `${left}%`, right: `${100 - right}%` });
    }
    this.dispatchEvent(new Event("change"));
  }

  /** Let it begin where the player is. */
  from() {
    const { time, motion } = this.player;
    this.stretch = [time, this.#stretch && this.#stretch[1] > time ? this.#stretch[1] : motion.end];
  }

  /** Let it end where the player is. */
  to() {
    const { time, motion } = this.player;
    this.stretch = [this.#stretch && this.#stretch[0] < time ? this.#stretch[0] : motion.start, time];
  }

  /** Keep a player that plays within the stretch. */
  #stay() {
    if (!this.#stretch || !this.player.playing) return;
    const [from, to] = this.#stretch;
    const ended = this.player.time > to && !this.player.loop;
    if (ended) this.player.pause();
    if (ended) this.player.seek(to);
    else if (this.player.time < from || this.player.time > to) this.player.seek(from);
  }

  /** Select by dragging with Shift; without it the line of time is the player's. */
  #drag(line) {
    const { motion } = this.player;
    const timeAt = ({ clientX }) => {
      const { left, width } = line.getBoundingClientRect();
      return motion.start + (Math.min(Math.max(clientX - left, 0), width) / width) * (motion.end - motion.start);
    };
    let begun; // where, while a stretch is drawn
    const take = (event) => {
      event.stopPropagation();
      this.stretch = [begun, timeAt(event)];
    };
    line.addEventListener(
      "pointerdown",
      (event) => {
        if (!event.shiftKey || event.button !== 0) return;
        line.setPointerCapture(event.pointerId);
        begun = timeAt(event);
        take(event);
      },
      true,
    );
    line.addEventListener("pointermove", (event) => begun !== undefined && take(event), true);
    line.addEventListener("lostpointercapture", () => (begun = undefined));
  }
}

/** Buttons, keys and their rows in the sheet of keys. */
function bind(selection) {
  $("controls").append($("selecting").content);
  const actions = { "[": () => selection.from(), "]": () => selection.to(), Escape: () => (selection.stretch = null) };
  for (const [id, key] of Object.entries({ from: "[", to: "]", none: "Escape" })) {
    $(id).addEventListener("click", actions[key]);
  }
  selection.addEventListener("change", () => ($("none").hidden = !selection.stretch));
  document.addEventListener("keydown", (event) => {
    if (event.target.closest("select, dialog") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (Object.hasOwn(actions, event.key)) actions[event.key]();
  });
  const made = (tag, ...content) => {
    const element = document.createElement(tag);
    element.append(...content);
    return element;
  };
  for (const [keys, does] of ROWS) {
    const shown = keys.flatMap((key, i) => [...(i > 0 ? [" "] : []), made("kbd", key)]);
    $("sheet").querySelector("dl").append(made("dt", ...shown), made("dd", does));
  }
}

/** Tell the notebook of the time and the selection, and do as it says; what it says is not told back. */
function share(player, selection) {
  const tell = (news) => parent.postMessage(news, "*");
  let listening = false;
  let last = -Infinity;
  const changed = (news) => () => {
    if (!listening) tell(news());
  };
  player.addEventListener("change", () => {
    if (player.playing && performance.now() - last < OFTEN) return;
    last = performance.now();
    changed(() => ({ time: player.time }))();
  });
  selection.addEventListener("change", changed(() => ({ selection: selection.stretch })));
  const acts = { time: (time) => player.seek(time), selection: (stretch) => (selection.stretch = stretch) };
  window.addEventListener("message", ({ source, data }) => {
    if (source !== parent) return;
    listening = true;
    for (const [name, act] of Object.entries(acts)) if (name in data) act(data[name]);
    listening = false;
  });
  tell({ ready: true });
}

// Where there is no 3D there is no player either.
if (window.motionmind && window.motionmind.motion.length > 1) {
  const { player } = window.motionmind;
  const selection = new Selection($("timeline"), player);
  bind(selection);
  share(player, selection);
  window.motionmind.selection = selection;
}
