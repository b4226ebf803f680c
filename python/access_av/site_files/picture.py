"""Background image of a plant's maps: PNG or JPEG, size and placement."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from access_av.errors import InputError
from access_av.settings import as_dict
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from access_av import _core

# Maximum size in bytes: base64 is a third longer, and a report stays below 2 MB.
MOST_BYTES = 384 << 10
PNG = b"\x89PNG\r\n\x1a\n"
JPEG = b"\xff\xd8\xff"
# JPEG's frame headers (ITU-T T.81, table B.1), which contain height and width.
FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}


@dataclass(frozen=True)
class Underlay:
    """Background image in the map frame.

    Attributes
    ----------
    url
        The image as a ``data:`` URL.
    left_m, right_m, low_m, high_m
        Coordinates of its edges.
    """

    url: str
    left_m: float
    right_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True)
class Placed:
    """File and placement of a background image, as in a site file.

    Attributes
    ----------
    file
        Path relative to the site file.
    metres_per_pixel
        Side of a pixel.
    zero_px
        Pixel of the map origin, from the upper left corner to the right and down.
    """

    file: str
    metres_per_pixel: float
    zero_px: tuple[float, float]


def underlay(site: _core.Site) -> Underlay | None:
    """Returns the background image of a site's maps; ``None`` without one.

    Raises
    ------
    InputError
        Missing or too large file, or neither PNG nor JPEG.
    """
    named = as_dict(site).get("underlay")
    if named is None:
        return None
    path = Path(named["file"])
    kind, width_px, height_px, data = _read(path)
    metres, (zero_x_px, zero_y_px) = named["metres_per_pixel"], named["zero_px"]
    return Underlay(
        url=f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}",
        left_m=-zero_x_px * metres,
        right_m=(width_px - zero_x_px) * metres,
        low_m=(zero_y_px - height_px) * metres,
        high_m=zero_y_px * metres,
    )


def size_px(path: Path) -> tuple[int, int]:
    """Returns width and height of an image in pixels.

    Raises
    ------
    InputError
        As for :func:`underlay`.
    """
    return _read(path)[1:3]


def _read(path: Path) -> tuple[str, int, int, bytes]:
    data = regular(path, MOST_BYTES).read_bytes()
    size = None
    if data.startswith(PNG):
        kind, size = "png", _png(data)
    elif data.startswith(JPEG):
        kind, size = "jpeg", _jpeg(data)
    if size is None or 0 in size:
        raise InputError(f"{path}: not a PNG or JPEG picture, or damaged")
    return (kind, *size, data)


def _png(data: bytes) -> tuple[int, int] | None:
    """Returns the size in the first chunk, IHDR (ISO/IEC 15948, 11.2.2)."""
    if len(data) < 33 or data[12:16] != b"IHDR":
        return None
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def _jpeg(data: bytes) -> tuple[int, int] | None:
    """Returns the size in the frame header (ITU-T T.81, B.2.2)."""
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker, length = data[at + 1], int.from_bytes(data[at + 2 : at + 4], "big")
        if marker == 0xFF:  # a fill byte
            at += 1
            continue
        if marker in FRAMES:
            height, width = data[at + 5 : at + 7], data[at + 7 : at + 9]
            return int.from_bytes(width, "big"), int.from_bytes(height, "big")
        at += 2 + length
    return None
