from .beats import Beats as Beats
from .reading import read_beats as read_beats
from .sound import Sound as Sound
from .sound import read_sound as read_sound

__all__ = ["Beats", "Sound", "read_beats", "read_sound"]
