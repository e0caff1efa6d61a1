from .transcribe import Deviation as Deviation
from .transcribe import Transcription as Transcription
from .transcribe import transcribe as transcribe

TOLERANCE_RANGE_DEG: tuple[float, float]

__all__ = ["Deviation", "Transcription", "transcribe"]
