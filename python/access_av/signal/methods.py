"""Names of the angle-of-arrival methods: keys and display names."""

from __future__ import annotations

LABELS = {"music": "MUSIC", "esprit": "ESPRIT", "root_music": "Root-MUSIC"}


def label(method: str, *, adaptive: bool = False) -> str:
    """Returns the display name of a method; ``adaptive`` marks an adaptive wake-up time.

    Examples
    --------
    >>> label("root_music"), label("music", adaptive=True)
    ('Root-MUSIC', 'Adaptive MUSIC')
    """
    name = LABELS.get(method, method)
    return f"Adaptive {name}" if adaptive else name
