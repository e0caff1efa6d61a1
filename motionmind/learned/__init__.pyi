from .plausibility import Sighting as Sighting

__all__ = ["Sighting"]
