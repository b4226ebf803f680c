from access_av._core import aoa as aoa

__all__ = ["__version__", "aoa"]

__version__: str
