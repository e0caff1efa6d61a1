/** The phone's keyboard, which covers the page instead of making it smaller. */

/** Keep its height in `--keyboard`, for what must stand above it. */
export function followKeyboard() {
  const { visualViewport: seen } = window;
  if (!seen) return;
  const follow = () => {
    const covered = innerHeight - seen.height * seen.scale; // two fingers that magnify the page cover nothing
    document.documentElement.style.setProperty("--keyboard", `${Math.max(Math.round(covered), 0)}px`);
  };
  seen.addEventListener("resize", follow);
  follow();
}
