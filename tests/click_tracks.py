"""Click tracks: sound with a click at given times, and what a page plays of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from motionmind._typing import Floats
from motionmind.music.sound import Sound

RATE_HZ = 44_100


def at_tempo(bpm: float, first: float, last: float) -> Floats:
    """Return the times of beats from `first` to `last`, seconds."""
    return np.arange(first, last, 60.0 / bpm)


def clicks(times: Floats, seconds: float, noise: float = 0.0) -> Sound:
    """Make a click track: each click is a tone that dies away; every fourth is higher."""
    samples = noise * np.random.default_rng(0).standard_normal(round(seconds * RATE_HZ))
    since = np.arange(round(0.1 * RATE_HZ)) / RATE_HZ
    for number, time in enumerate(times):
        click = np.sin(2.0 * np.pi * (1500.0 if number % 4 else 2000.0) * since) * np.exp(-150.0 * since)
        at = round(float(time) * RATE_HZ)
        count = min(len(click), len(samples) - at)
        samples[at : at + count] += 0.8 * click[:count]
    return Sound(samples[:, None].astype(np.float32), RATE_HZ)


def onsets(sound: Sound, apart: float = 0.15) -> Floats:
    """Return when clicks begin: where the sound first is loud after it was quiet for `apart` seconds."""
    loud = np.flatnonzero(np.abs(sound.samples).max(axis=1) > 0.15) / sound.rate
    return loud[np.concatenate([[True], np.diff(loud) > apart])]


_RECORD = """
(async () => {
  const { sound, player } = PLACE, { context } = sound;
  await sound.ready;
  const code = `registerProcessor("listener", class extends AudioWorkletProcessor {
    process([[heard]]) {
      for (let i = 0; heard && i < heard.length; i++) {
        const now = currentTime + i / sampleRate;
        if (Math.abs(heard[i]) < 0.15) continue;
        if (now - (this.last ?? -1) > 0.15) this.port.postMessage(now);
        this.last = now;
      }
      return true;
    }
  });`;
  await context.audioWorklet.addModule("data:text/javascript," + encodeURIComponent(code));
  const listener = new AudioWorkletNode(context, "listener");
  sound.output.connect(listener);
  window.found = { onsets: [], heads: [] };
  listener.port.onmessage = ({ data }) => found.onsets.push(data);
  player.addEventListener("change", () => found.heads.push([context.currentTime, player.time]));
})()
"""


def recording(place: str) -> str:
    """Return a script that records when clicks leave a page, and where the play head is then, in `found`.

    Args:
        place: an object with the page's `sound` and `player`.
    """
    return _RECORD.replace("PLACE", place)


def played(found: dict[str, Any], latency: float) -> Floats:
    """Return where the play head was at each click that was heard, seconds; NaN between the end and the start."""
    heads = np.array(found["heads"])
    out = []
    for onset in np.array(found["onsets"]) + latency:
        at = int(np.searchsorted(heads[:, 0], onset))
        if not 0 < at < len(heads):
            continue
        (before, one), (after, other) = heads[at - 1 : at + 1]
        out.append(np.nan if other < one else one + (other - one) * (onset - before) / max(after - before, 1e-9))
    return np.array(out)
