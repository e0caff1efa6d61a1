from .cleaning import Cleaning as Cleaning
from .cleaning import clean_motion as clean_motion

__all__ = ["Cleaning", "clean_motion"]
