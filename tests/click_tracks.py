"""Click tracks: sound with a click at given times."""

from __future__ import annotations

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
