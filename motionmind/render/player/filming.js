/** The button that films: how far the film is, and the file that it becomes. */

import { film, obstacle } from "motionmind/film";

const UNSAFE = /[\\/:*?"<>|\u0000-\u001f\u007f]+/g; // in names of files, on some system

export class Filming {
  /**
   * @param {HTMLElement} button starts a film, and stops it
   * @param {HTMLElement} box shows how far it is; in it a progress bar, words, a link and a button that closes it
   * @param {Stage} stage
   * @param {Player} player
   * @param {function} ghosts what `stage.show` is to show beside the body
   */
  constructor(button, box, stage, player, ghosts) {
    this.button = button;
    this.box = box;
    this.stage = stage;
    this.player = player;
    this.ghosts = ghosts;
    [this.bar, this.words, this.link, this.close] = ["progress", "p", "a", "button"].map((tag) => box.querySelector(tag));
    button.addEventListener("click", () => (this.running ? this.stopper.abort() : this.#start()));
    this.close.addEventListener("click", (event) => {
      if (event.detail === 0) button.focus(); // closed by a key
      box.hidden = true;
    });
    this.running = false;
  }

  async #start() {
    const { motion } = this.player;
    URL.revokeObjectURL(this.link.href);
    this.box.hidden = false;
    this.link.hidden = true;
    this.bar.hidden = true;
    const wrong = obstacle();
    if (wrong) {
      this.words.textContent = wrong;
      return;
    }
    const before = this.player.time;
    this.player.pause();
    this.stopper = new AbortController();
    this.#run(true);
    this.words.textContent = "Filming…";
    try {
      const onFrame = (time) => {
        this.bar.value = (time - motion.start) / (motion.end - motion.start);
        this.player.seek(time);
      };
      this.#offer(await film(this.stage, motion, this.ghosts(), onFrame, this.stopper.signal));
    } catch (error) {
      const stopped = this.stopper.signal.aborted;
      this.words.textContent = stopped ? "Stopped; nothing was saved." : `No film was made: ${error.message}`;
    }
    this.#run(false);
    this.player.seek(before);
  }

  #run(running) {
    this.running = running;
    this.stage.filming = running;
    this.button.textContent = running ? "Stop" : "Film";
    this.bar.hidden = !running;
    this.close.hidden = running;
  }

  /** Save a film, and leave a link by which it is saved again. */
  #offer(blob) {
    const name = `${document.title.replace(UNSAFE, "-").replace(/^[. ]+|[. ]+$/g, "") || "movement"}.webm`;
    const { start, end } = this.player.motion;
    this.words.textContent = `${(end - start).toFixed(2)} s, ${(blob.size / 1e6).toFixed(1)} MB. `;
    if (window.parent !== window) this.words.textContent += "If the frame lets nothing be saved, open the page by itself. ";
    Object.assign(this.link, { href: URL.createObjectURL(blob), download: name, textContent: `Save ${name}`, hidden: false });
    this.link.click();
  }
}
