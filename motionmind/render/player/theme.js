/** Whether the page is dark: as the system is, until somebody switches. It fires "change". */

export class Theme extends EventTarget {
  constructor() {
    super();
    const system = matchMedia("(prefers-color-scheme: dark)");
    this.dark = system.matches;
    this.switched = false;
    system.addEventListener("change", () => {
      if (!this.switched) this.#set(system.matches);
    });
  }

  /** Make light dark, and dark light. */
  toggle() {
    this.switched = true;
    this.#set(!this.dark);
  }

  #set(dark) {
    this.dark = dark;
    // Without a switch the style sheet follows the system by itself.
    if (this.switched) document.documentElement.style.colorScheme = dark ? "dark" : "light";
    this.dispatchEvent(new Event("change"));
  }
}
