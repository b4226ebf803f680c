"""Names of the angle-of-arrival methods the paper compares, as written and as shown."""

from __future__ import annotations

METHODS = ("music", "esprit", "root_music")

LABELS = {"music": "MUSIC", "esprit": "ESPRIT", "root_music": "Root-MUSIC"}

ADAPTIVE_LABEL = "Adaptive MUSIC"


def label(method: str, *, adaptive: bool = False) -> str:
    """Name of a method as a reader sees it."""
    return ADAPTIVE_LABEL if adaptive else LABELS.get(method, method)
