from .effort import measure_effort as measure_effort
from .figures import Figure as Figure
from .figures import measure as measure

__all__ = ["Figure", "measure", "measure_effort"]
