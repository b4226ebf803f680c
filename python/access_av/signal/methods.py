"""Names of the angle-of-arrival methods, as written and as shown."""

from __future__ import annotations

LABELS = {"music": "MUSIC", "esprit": "ESPRIT", "root_music": "Root-MUSIC"}


def label(method: str, *, adaptive: bool = False) -> str:
    """Name of a method as a reader sees it; ``adaptive`` where the wake-up time is.

    Examples
    --------
    >>> label("root_music"), label("music", adaptive=True)
    ('Root-MUSIC', 'Adaptive MUSIC')
    """
    name = LABELS.get(method, method)
    return f"Adaptive {name}" if adaptive else name
