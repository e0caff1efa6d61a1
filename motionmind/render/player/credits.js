/** The credits: whose movement a motion is made of. */

/**
 * Write the lines of each heading into a list; nothing is shown of a motion without credits. What somebody should beware
 * of is open at first.
 * @param {HTMLDetailsElement} details with a description list
 * @param {Object<string, string[]>} credits lines by heading
 */
export function writeCredits(details, credits) {
  const list = details.querySelector("dl");
  for (const [heading, lines] of Object.entries(credits)) {
    const term = document.createElement("dt");
    term.textContent = heading;
    list.append(term);
    for (const line of lines) {
      const description = document.createElement("dd");
      description.textContent = line;
      list.append(description);
    }
  }
  details.open = "beware" in credits;
  details.hidden = Object.keys(credits).length === 0;
}
