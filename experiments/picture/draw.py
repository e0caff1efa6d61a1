"""Draw a motion, evenly spaced, on a contact sheet: `python draw.py tween.json tween.png`."""

import sys
from pathlib import Path

import numpy as np

from motionmind.formats import read_motion
from motionmind.render.sheet import contact_sheet

FIGURES, COLUMNS = 10, 5

if __name__ == "__main__":
    motion = read_motion(Path(sys.argv[1]))
    frames = np.linspace(0, len(motion) - 1, min(FIGURES, len(motion))).round().astype(int).tolist()
    contact_sheet(motion, frames, columns=COLUMNS).save(sys.argv[2], optimize=True)
