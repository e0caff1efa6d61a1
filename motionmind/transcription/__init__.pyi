from .transcribe import Deviation as Deviation
from .transcribe import Transcription as Transcription
from .transcribe import transcribe as transcribe

__all__ = ["Deviation", "Transcription", "transcribe"]
