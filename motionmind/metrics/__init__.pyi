from .figures import Figure as Figure
from .figures import measure as measure

__all__ = ["Figure", "measure"]
