from .credit import Credit as Credit

__all__ = ["Credit"]
