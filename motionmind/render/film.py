"""Films and stills of movement: `.gif` and `.mp4`, and one posture as `.png`.

Frames are drawn as they are encoded; memory holds two at most.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

import numpy as np
from PIL import GifImagePlugin, Image

from motionmind._typing import Floats, Int16s, Pixels
from motionmind.body.motion import Motion
from motionmind.ensemble.dancers import Ensemble
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.jit import jit
from motionmind.music.sound import Sound
from motionmind.render.group import GroupStage
from motionmind.render.stage import Stage
from motionmind.render.timing import HOLD_S, MIN_FPS, N_USUAL_FRAMES, film_rate, frame_rate, frame_times

_N_COLOURS = 255  # of a GIF's palette; one more index stands for unchanged pixels
_SHIFT_BITS = 2  # of each channel that the lookup in the palette drops
_N_LEVELS = 256 >> _SHIFT_BITS  # of each channel that the lookup tells apart


def write_film(
    path: FilePath,
    motion: Motion,
    *,
    fps: float | None = None,
    view: str = "quarter",
    size: int = 480,
    first: int = 0,
    sound: Sound | None = None,
) -> None:
    """Film a motion as `.gif`, which loops and holds its last posture for 0.8 s, or as `.mp4` (H.264).

    The frames include the first and the last posture. The film lasts as long as the motion, a GIF to a hundredth of a
    second (and the hold), an MP4 to a frame.

    Args:
        path: the file.
        motion: the motion, on any skeleton.
        fps: frames a second, from 0.01 to 50 in a GIF, to 120 in an MP4; by default the motion's own (25 if fewer than
            12), at most 25 in a GIF and 60 in an MP4, and lower if a GIF would have more than 1,000 frames, or an MP4
            more than that plus a sixteenth of the motion's frames times joints.
        view: the name of one of `view.VIEWS`.
        size: height of the picture, pixels, from 120 to 2160; a flat movement makes it lower.
        first: number of the motion's first frame in the longer motion that it is a part of.
        sound: sound of an MP4, which begins with the motion; None for a silent film.

    Raises:
        MotionMindError: the suffix is neither, a number is out of range, there would be more than four times that many
            frames, the extra for MP4 is not installed, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    usual = _check_film(path, suffix, fps)
    # An MP4 has more, so that a film of a person (23 joints) keeps all recorded frames, however many.
    more = 0 if suffix == ".gif" else len(motion) * len(motion.skeleton) // 16
    rate = film_rate(motion, min(frame_rate(motion), usual), fps, N_USUAL_FRAMES + more)
    stage = Stage(motion, frame_times(motion, rate), view=view, size=size, first=first)
    write_atomically(path, gif(stage) if suffix == ".gif" else mp4(stage, rate, sound))


def write_group_film(
    path: FilePath,
    ensemble: Ensemble,
    *,
    fps: float | None = None,
    view: str = "quarter",
    size: int = 480,
    sound: Sound | None = None,
) -> None:
    """Film an ensemble as `.gif` or `.mp4`; arguments and errors as of `write_film`."""
    suffix = Path(path).suffix.lower()
    usual = _check_film(path, suffix, fps)
    seconds = ensemble.seconds
    rate = fps or min(usual, max(MIN_FPS, N_USUAL_FRAMES / max(seconds, 1.0)))
    if seconds * rate > 4 * N_USUAL_FRAMES:
        raise MotionMindError(f"{path}: {seconds:.0f} s at {rate:g} frames a second are too many frames; give fewer")
    stage = GroupStage(ensemble.motions(ensemble.times(rate)), view=view, size=size)
    write_atomically(path, gif(stage) if suffix == ".gif" else mp4(stage, rate, sound))


def _check_film(path: FilePath, suffix: str, fps: float | None) -> float:
    """Check the suffix and the rate of a film; return the usual rate, frames a second."""
    if suffix not in {".gif", ".mp4"}:
        raise MotionMindError(f"{path}: a film is a .gif or an .mp4, not {suffix or 'a file without suffix'}")
    # Browsers play no GIF faster than 50.
    usual, most = (25.0, 50.0) if suffix == ".gif" else (60.0, 120.0)
    if fps is not None and not MIN_FPS <= fps <= most:
        raise MotionMindError(f"{path}: a {suffix} has from {MIN_FPS:g} to {most:g} frames a second, not {fps:g}")
    return usual


def write_still(path: FilePath, motion: Motion, *, view: str = "quarter", size: int = 480) -> None:
    """Draw a motion of one posture as `.png`; arguments and errors as of `write_film`."""
    if len(motion) != 1 or Path(path).suffix.lower() != ".png":
        raise MotionMindError(f"{path}: a still is a .png of one posture, not of {len(motion)}")
    file = BytesIO()
    Image.fromarray(Stage(motion, view=view, size=size).picture(0)).save(file, "png")
    write_atomically(path, file.getvalue())


# --- GIF --------------------------------------------------------------------------------------------------------------


def gif(stage: Stage | GroupStage) -> bytes:
    """Encode the film of a stage as a GIF; each frame holds only the box that changed, and in it the changed pixels."""
    palette, height, width = _palette(stage), stage.camera.height, stage.camera.width
    table = np.full(_N_LEVELS**3, -1, dtype=np.int16)
    shown = np.full((height, width), _N_COLOURS, dtype=np.uint8)
    parts = [
        b"GIF89a" + _uint16(width) + _uint16(height) + b"\xf7\x00\x00",  # 0xf7: one palette of 256 colours
        palette.tobytes(),
        b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00",  # loops forever
    ]
    for picture, hold in zip(stage.frames(), _delays(stage), strict=True):
        changed = np.empty_like(shown)
        top, bottom, left, right = _index(picture, palette, table, shown, changed)
        box = Image.fromarray(changed[top:bottom, left:right])
        # Unchanged pixels are transparent, and show the frame before.
        parts.append(b"\x21\xf9\x04\x05" + _uint16(hold) + bytes([_N_COLOURS, 0]))
        parts += GifImagePlugin.getdata(box, (left, top))
    return b"".join([*parts, b";"])


def _delays(stage: Stage | GroupStage) -> list[int]:
    """Return how long to show each frame, in hundredths of a second; rounding errors do not add up."""
    marks = np.round(100.0 * (stage.motion.times - stage.motion.times[0])).astype(int)
    return [*np.diff(marks).tolist(), round(100.0 * HOLD_S)]


def _palette(stage: Stage | GroupStage) -> Pixels:
    """Choose one palette [256, 3] for all frames, to avoid flicker, from a sample of them; its last colour is unused.

    A colour counts by the root of its frequency; otherwise paper and floor would leave no colours for small details.
    """
    special = [np.flatnonzero(kind)[:1] for kind in (stage.motion.inserted(), stage.motion.bridged().any(axis=1))]
    even = np.linspace(0, len(stage) - 1, 10).astype(int)
    tally = np.zeros((_N_LEVELS**3, 4))
    for picture in stage.frames(np.unique(np.concatenate([even, *special])).tolist()):
        _count(picture, tally)
    cells = tally[tally[:, 3] > 0.0]
    colours = np.round(cells[:, :3] / cells[:, 3:]).astype(np.uint8)
    sample = np.repeat(colours, np.ceil(np.sqrt(cells[:, 3])).astype(int), axis=0)
    quantised = Image.fromarray(sample[None]).quantize(_N_COLOURS, Image.Quantize.MEDIANCUT, kmeans=1)
    chosen = np.array(quantised.getpalette(), dtype=np.uint8).reshape(-1, 3)[:_N_COLOURS]
    return np.concatenate([chosen, np.zeros((_N_COLOURS + 1 - len(chosen), 3), dtype=np.uint8)])


def _uint16(number: int) -> bytes:
    return number.to_bytes(2, "little")


@jit
def _count(picture: Pixels, tally: Floats) -> None:
    """Add a picture's pixels [H, W, 3] to the sums of red, green and blue, and the counts, of their cells [C, 4]."""
    for row in picture:
        for r, g, b in row:
            cell = ((r >> _SHIFT_BITS) * _N_LEVELS + (g >> _SHIFT_BITS)) * _N_LEVELS + (b >> _SHIFT_BITS)
            tally[cell, 0] += r
            tally[cell, 1] += g
            tally[cell, 2] += b
            tally[cell, 3] += 1.0


@jit
def _index(
    picture: Pixels, palette: Pixels, table: Int16s, shown: Pixels, changed: Pixels
) -> tuple[int, int, int, int]:
    """Map a picture to the palette, and find the pixels that changed.

    Args:
        picture: RGB [H, W, 3].
        palette: RGB [256, 3].
        table: index of the palette's colour nearest to each cell's middle [C], -1 while unknown; filled in.
        shown: indices that the frame before showed [H, W]; updated to this frame's.
        changed: receives this frame's indices [H, W] where they changed, elsewhere the palette's last.

    Returns:
        The box of changed pixels: first row, row after the last, first column, column after the last.
    """
    height, width = shown.shape
    top, bottom, left, right = height, 0, width, 0
    for y in range(height):
        for x in range(width):
            r, g, b = picture[y, x, 0] >> _SHIFT_BITS, picture[y, x, 1] >> _SHIFT_BITS, picture[y, x, 2] >> _SHIFT_BITS
            cell = (r * _N_LEVELS + g) * _N_LEVELS + b
            if table[cell] < 0:
                middle = 1 << (_SHIFT_BITS - 1)
                best = 1 << 30
                for colour in range(_N_COLOURS):
                    dr = palette[colour, 0] - ((r << _SHIFT_BITS) + middle)
                    dg = palette[colour, 1] - ((g << _SHIFT_BITS) + middle)
                    db = palette[colour, 2] - ((b << _SHIFT_BITS) + middle)
                    apart = dr * dr + dg * dg + db * db
                    if apart < best:
                        best, table[cell] = apart, colour
            changed[y, x] = _N_COLOURS
            if table[cell] != shown[y, x]:
                shown[y, x] = changed[y, x] = table[cell]
                top, bottom, left, right = min(top, y), y + 1, min(left, x), max(right, x + 1)
    if bottom == 0:  # nothing changed, but a frame has at least one pixel
        return 0, 1, 0, 1
    return top, bottom, left, right


# --- MP4 --------------------------------------------------------------------------------------------------------------


def mp4(stage: Stage | GroupStage, rate: float, sound: Sound | None = None) -> bytes:
    """Encode the film of a stage as H.264 in an MP4; arguments and errors as of `encode_mp4`."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        encode_mp4(path, stage, rate, stage.frames(), sound)
        return path.read_bytes()


def encode_mp4(
    path: Path, stage: Stage | GroupStage, rate: float, pictures: Iterator[Pixels], sound: Sound | None = None
) -> None:
    """Encode the film of a stage as H.264 in an MP4.

    Args:
        path: the file.
        stage: the stage.
        rate: frames a second.
        pictures: the pictures of its frames.
        sound: sound that begins with the first frame; the film has as much of it as it lasts. None for a silent film.

    Raises:
        MotionMindError: the encoder is not installed, or fails.
    """
    program = encoder_program()
    if program is None:
        raise MotionMindError('.mp4 needs an encoder: pip install "motionmind[film]"')
    log, track = path.with_suffix(".log"), path.with_suffix(".wav")
    try:
        if sound:
            track.write_bytes(sound.part(0.0, len(stage.motion) / rate).encode("WAV"))
        command = [program, *_arguments(stage, rate, str(track) if sound else None), str(path)]
        with log.open("w+b") as output, subprocess.Popen(command, stdin=subprocess.PIPE, stderr=output) as encoder:
            _feed(encoder.stdin, pictures)
    except OSError as error:
        raise MotionMindError(f"the MP4 encoder cannot be run: {error}") from error
    if encoder.returncode != 0:
        lines = log.read_text(errors="replace").strip().splitlines() or ["no message"]
        raise MotionMindError(f"the MP4 encoder failed: {lines[0]}")


def encoder_program() -> str | None:
    """Return the path of ffmpeg, from the extra `film` or else from this computer; None if it has none."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        return shutil.which("ffmpeg")


def _arguments(stage: Stage | GroupStage, rate: float, track: str | None) -> list[str]:
    """Return the encoder's arguments, for a film with the sound of the file `track`, if any.

    Colours are converted to BT.709 and declared so; otherwise players guess, and reds turn orange. A constant rate
    factor of 17 shows no blocks in drawn figures. The bytes depend on the number of threads, so it is fixed.
    """
    size = f"{stage.camera.width}x{stage.camera.height}"
    raw = f"-f rawvideo -pix_fmt rgb24 -s {size} -r {Fraction(rate).limit_denominator(1001)}"
    video = "-c:v libx264 -preset medium -crf 17 -tune animation -threads 2"
    colour = "-colorspace bt709 -color_primaries bt709 -color_trc bt709 -color_range tv"
    convert = "-vf scale=out_color_matrix=bt709:out_range=tv,format=yuv420p"
    whole = "-movflags +faststart -fflags +bitexact -flags:v +bitexact"
    start = f"-y -nostdin -loglevel error {raw} -i -".split()
    sounding = ["-i", track, *["-c:a", "aac", "-b:a", "192k", "-flags:a", "+bitexact"]] if track else ["-an"]
    return [*start, *sounding, *f"{convert} {video} {colour} {whole}".split()]


def _feed(pipe: IO[bytes] | None, pictures: Iterator[Pixels]) -> None:
    """Write pictures to the encoder, until it closes its pipe."""
    assert pipe is not None
    try:
        for picture in pictures:
            pipe.write(picture.tobytes())
        pipe.close()
    except BrokenPipeError:  # the encoder failed, and its log says why
        pass
