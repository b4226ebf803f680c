"""The angle-of-arrival methods that the paper compares."""

from __future__ import annotations

from access_av.methods import label

METHODS = ("music", "esprit", "root_music")

ADAPTIVE_LABEL = label("music", adaptive=True)
