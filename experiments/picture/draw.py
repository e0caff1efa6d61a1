"""Draw a motion as a row of figures, seen from the front and from the side: `python draw.py tween.json tween.png`."""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from motionmind.formats import read_motion
from motionmind.motion import Motion

FIGURES = 9
CELL, METRE, SMOOTH = 150, 66, 3  # pixels a figure, pixels a metre, samples a pixel
WIDTHS = {"hip": 0.13, "knee": 0.10, "ankle": 0.06, "toes": 0.06, "lumbar": 0.17, "thorax": 0.20, "cervical": 0.12}
COLOURS = {"left": (196, 74, 58), "right": (52, 101, 164), "": (70, 70, 78)}


def draw(motion: Motion, figures: int = FIGURES) -> Image.Image:
    """The picture: evenly spaced frames from left to right, from the front above, from the body's left below."""
    frames = np.linspace(0, len(motion) - 1, figures).round().astype(int)
    size = (figures * CELL * SMOOTH, 2 * CELL * SMOOTH)
    image = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(image)
    skeleton = motion.skeleton
    points = skeleton.positions_and_tips(motion.rotations, motion.root)
    for column, frame in enumerate(frames):
        for row, (across, depth) in enumerate(((0, 2), (2, 0))):
            foot = ((column + 0.5) * CELL * SMOOTH, ((row + 1) * CELL - 12) * SMOOTH)
            flat = np.array([1.0, -1.0]) * (points[frame][:, [across, 1]] - [points[frame, 0, across], 0.0])
            places = flat * METRE * SMOOTH + foot
            pen.line(
                [(foot[0] - CELL * SMOOTH * 0.4, foot[1]), (foot[0] + CELL * SMOOTH * 0.4, foot[1])], "#ccc", SMOOTH
            )
            bones = [(parent, j, skeleton.names[j]) for j, parent in enumerate(skeleton.parents) if parent >= 0]
            bones += [(j, len(skeleton) + j, name) for j, name in enumerate(skeleton.names) if skeleton.tips[j].any()]
            for a, b, name in sorted(bones, key=lambda bone: points[frame, bone[1], depth]):  # the farthest first
                side = name.split("_")[0] if "_" in name else ""
                head = name == "atlantal" and b >= len(skeleton)
                _bone(
                    pen, places[a], places[b], 0.17 if head else WIDTHS.get(name.split("_")[-1], 0.055), COLOURS[side]
                )
    return image.resize((size[0] // SMOOTH, size[1] // SMOOTH), Image.Resampling.LANCZOS)


def _bone(pen: ImageDraw.ImageDraw, a: np.ndarray, b: np.ndarray, width: float, colour: tuple[int, int, int]) -> None:
    half = width * METRE * SMOOTH / 2
    pen.line([tuple(a), tuple(b)], colour, int(2 * half))
    for end in (a, b):
        pen.ellipse([*(end - half), *(end + half)], colour)


if __name__ == "__main__":
    draw(read_motion(Path(sys.argv[1]))).save(sys.argv[2], optimize=True)
