"""Sound: samples in step with movement, and the files that hold them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np

from motionmind._typing import Singles
from motionmind.arguments import check_integer, check_path, check_real, check_text, check_type
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, read_bytes

SOUND_SUFFIXES = (".wav", ".flac", ".ogg", ".mp3")
MAX_SOUND_S = 1200.0  # of music: 20 minutes, 0.4 GB of samples
MAX_SOUND_BYTES = 500_000_000  # of a file
_RATES_HZ = (4_000, 192_000)
MAX_CHANNELS = 8
_MAX_VALUES = 120_000_000  # samples of all channels: 20 minutes of stereo at 48 kHz
NEEDS_EXTRA = 'needs the extra: pip install "motionmind[music]"'


@dataclass(frozen=True, eq=False)
class Sound:
    """Sound: samples from -1 to 1 [N, C] in one or two channels, `rate` a second.

    >>> import numpy as np
    >>> from motionmind.music import Sound
    >>> Sound(np.zeros((4410, 1), np.float32), 44100).seconds
    0.1
    """

    samples: Singles
    rate: int

    def __post_init__(self) -> None:
        check_type("samples", self.samples, np.ndarray, wanted="an array of numbers")
        check_integer("rate", self.rate)
        samples = np.asarray(self.samples, dtype=np.float32)
        if samples.ndim != 2 or samples.shape[1] not in (1, 2) or not np.isfinite(samples).all():
            raise MotionMindError(f"sound must be finite samples [N, 1 or 2], not {list(samples.shape)}")
        if not _RATES_HZ[0] <= self.rate <= _RATES_HZ[1]:
            raise MotionMindError(f"sound must have from 4,000 to 192,000 samples a second, not {self.rate}")
        object.__setattr__(self, "samples", samples)

    def __repr__(self) -> str:
        return f"<Sound of {self.seconds:.2f} s, {self.samples.shape[1]} x {self.rate} Hz>"

    @property
    def seconds(self) -> float:
        """Its length."""
        return len(self.samples) / self.rate

    def part(self, start: float, seconds: float) -> Sound:
        """Return the sound from `start` on, for `seconds`; silent before its beginning and after its end."""
        check_real("start", start)
        check_real("seconds", seconds)
        first, count = round(start * self.rate), round(seconds * self.rate)
        out = np.zeros((count, self.samples.shape[1]), dtype=np.float32)
        low, high = max(first, 0), min(first + count, len(self.samples))
        if low < high:
            out[low - first : high - first] = self.samples[low:high]
        return Sound(out, self.rate)

    def encode(self, kind: Literal["WAV", "FLAC"]) -> bytes:
        """Encode the sound as a file, 16 bits a sample."""
        check_text("kind", kind)
        import soundfile

        file = BytesIO()
        soundfile.write(file, np.clip(self.samples, -1.0, 1.0), self.rate, format=kind, subtype="PCM_16")
        return file.getvalue()


def read_sound(path: FilePath) -> Sound:
    """Read a sound file: `.wav`, `.flac`, `.ogg` or `.mp3`, of at most 20 minutes. More than two channels are mixed.

    Raises:
        FormatError: the file cannot be read, is empty or too long.
        MotionMindError: the extra `music` is not installed.

    >>> from motionmind.music import read_sound
    >>> read_sound("nowhere.wav")
    Traceback (most recent call last):
    motionmind.errors.FormatError: nowhere.wav: cannot be read: there is no such file or folder
    """
    check_path("path", path)
    with opened(path) as file:
        samples = samples_of(file, path)
        return Sound(samples if samples.shape[1] <= 2 else samples.mean(axis=1, keepdims=True), file.samplerate)


@contextmanager
def opened(path: FilePath) -> Iterator[Any]:
    """Open a sound file as a `soundfile.SoundFile`, checked; errors as of `read_sound`."""
    suffix = Path(path).suffix.lower()
    if suffix not in SOUND_SUFFIXES:
        raise FormatError(f"is no sound file: these end in {', '.join(SOUND_SUFFIXES)}", path=path)
    try:
        import soundfile
    except ImportError as error:
        raise MotionMindError(f"{path}: sound {NEEDS_EXTRA}") from error
    data = read_bytes(path)
    if len(data) > MAX_SOUND_BYTES:
        raise FormatError(f"has {len(data) / 1e6:.0f} MB; sound files may have 500", path=path)
    try:
        with soundfile.SoundFile(BytesIO(data)) as file:
            if not (_RATES_HZ[0] <= file.samplerate <= _RATES_HZ[1] and 1 <= file.channels <= MAX_CHANNELS):
                shape = f"{file.channels} channels of {file.samplerate} Hz"
                raise FormatError(f"has {shape}, not 1 to {MAX_CHANNELS} of 4,000 to 192,000", path=path)
            yield file
    except soundfile.SoundFileError as error:
        raise FormatError(f"cannot be read as sound: {error}", path=path) from error


def samples_of(file: Any, path: FilePath) -> Singles:
    """Return the samples [N, C] of an opened sound file; FormatError if there are none, or too many."""
    frames = file.frames
    if frames > min(MAX_SOUND_S * file.samplerate, _MAX_VALUES / file.channels):
        raise FormatError(f"is too long: sound may last {MAX_SOUND_S / 60.0:g} minutes; take a part of it", path=path)
    # At once: after each read soundfile seeks, and behind a seek MP3 misses some samples.
    samples: Singles = file.read(frames, dtype="float32", always_2d=True)
    if len(samples) == 0:
        raise FormatError("holds no sound", path=path)
    if not np.isfinite(samples).all():
        raise FormatError("holds samples that are not finite numbers", path=path)
    return samples


def sound_beside(path: Path) -> Path | None:
    """Return the sound track of a file of movement, which has its name, such as clip.wav beside clip.bvh; or None."""
    beside = (path.with_suffix(suffix) for suffix in SOUND_SUFFIXES)
    return next((file for file in beside if file.is_file()), None)
