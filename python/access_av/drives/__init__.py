"""Recorded drives: synthesis from a scenario, localization, comparison with a truth.

Examples
--------
>>> from access_av import drives
>>> drives.DATATYPES
('ci16_le', 'cf32_le')
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.lazy import attach

if TYPE_CHECKING:
    from access_av.drives.recorded import (
        DATATYPES,
        FINDINGS,
        MOST_TRUTH_GAP_S,
        Drive,
        SynthesizedDrive,
        error_m,
        locate,
        log_angles,
        read_tum,
        summary,
        synthesize,
    )

__all__ = [
    "DATATYPES", "FINDINGS", "MOST_TRUTH_GAP_S", "Drive", "SynthesizedDrive", "error_m",
    "locate", "log_angles", "read_tum", "summary", "synthesize",
]  # fmt: skip

if not TYPE_CHECKING:
    __getattr__, __dir__ = attach(__name__)
