from .restyling import Link as Link
from .restyling import Restyled as Restyled
from .restyling import pass_through as pass_through
from .restyling import restyle as restyle
from .transcribe import Deviation as Deviation
from .transcribe import Transcription as Transcription
from .transcribe import transcribe as transcribe

TOLERANCE_RANGE_DEG: tuple[float, float]
LONGEST_MOVE_S: float

__all__ = ["Deviation", "Link", "Restyled", "Transcription", "pass_through", "restyle", "transcribe"]
