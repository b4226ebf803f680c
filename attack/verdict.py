"""Verdict of a case: faults in its end, its messages and its files."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
from mcap.reader import make_reader

if TYPE_CHECKING:
    from pathlib import Path

# Exit codes: success; invalid input; located, but mostly lost.
CODES = (0, 2, 3)
LONGEST_MESSAGE = 500
NONSENSE_M = 100.0
# Minimum eigenvalue of a correlation matrix: tolerance for rounding.
ROUNDING = -1e-9
# Tolerance of the motion of a pose (standard deviations), and maximum ratio of odometer reading to
# driven distance: the faults of random drives have a slip of up to one half.
LEAP_SIGMAS = 5.0
MOST_READ = 1.6
# Doubles at the end of a nav_msgs/msg/Odometry: pose and twist with their covariances.
ODOMETRY_NUMBERS = 85


@dataclass
class Verdict:
    """Findings, number of ``ok`` epochs, and number of them with an error above the level."""

    findings: list[str] = field(default_factory=list)
    ok: int = 0
    beyond: int = 0

    def says(self, kind: str, text: object) -> None:
        """Adds a finding; its first word is the kind."""
        self.findings.append(f"{kind}: {str(text)[:300]}")


def judge(
    folder: Path, command: list[str], before: set[Path], end: dict[str, Any], *, odometer: bool
) -> Verdict:
    """Judges the end of a command, and the files that were not there ``before``.

    ``odometer``: whether the odometer reads at most ``MOST_READ`` of the driven distance. If true,
    the odometer limits the plausible motion of the pose.
    """
    verdict = Verdict()
    if end["raised"]:
        kind = "panic" if "PanicException" in end["raised"] else "traceback"
        verdict.says(kind, end["raised"][-300:])
    elif end["code"] not in CODES:
        verdict.says("code", end["code"])
    _messages(verdict, end["err"])
    if "--json" in command and end["code"] == 0:
        _json(verdict, "standard output", end["out"])
    for file in sorted(set(folder.rglob("*")) - before):
        if not file.is_file():
            continue
        name = str(file.relative_to(folder))
        if file.name.endswith(".partial"):
            verdict.says("half-written", name)
        elif file.suffix == ".parquet":
            _table(verdict, name, pl.read_parquet(file, glob=False), odometer=odometer)
        elif file.suffix in (".json", ".sigmf-meta"):
            _json(verdict, name, file.read_text(encoding="utf-8"))
        elif file.suffix == ".tum" and file.stat().st_size:
            _finite(verdict, name, np.loadtxt(file, ndmin=2))
        elif file.suffix == ".mcap":
            _mcap(verdict, name, file)
    return verdict


def _messages(verdict: Verdict, text: str) -> None:
    if "Traceback (most" in text or "panicked at" in text:
        verdict.says("traceback", text[-300:])
    if warned := re.search(r"\w+Warning: .*", text):
        verdict.says("warning", warned[0])
    if control := re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", text):
        verdict.says("control-character", repr(control[0]))
    for message in re.split(r"^(?=error: |warning: |not to be relied on)", text, flags=re.M):
        words = re.sub(r"[\s│╭╮╰╯─]+", " ", message)
        words = re.sub(r"^Usage: .* for help\. Error ", "", words)  # a usage error's frame
        if len(words) > LONGEST_MESSAGE + 100:
            verdict.says("long-message", f"{len(words)} characters: {words[:100]}")


def _json(verdict: Verdict, name: str, text: str) -> None:
    def refuse(constant: str) -> None:
        verdict.says("nan", f"{constant} in {name}")

    try:
        json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        verdict.says("broken-json", f"{name}: {error}")


def _finite(verdict: Verdict, name: str, numbers: Any) -> None:
    if not np.isfinite(numbers).all():
        verdict.says("nan", name)


def _mcap(verdict: Verdict, name: str, file: Path) -> None:
    with file.open("rb") as stream:
        for schema, _, message in make_reader(stream).iter_messages():
            if schema is not None and schema.name == "nav_msgs/msg/Odometry":
                _finite(verdict, name, np.frombuffer(message.data[-8 * ODOMETRY_NUMBERS :], "<f8"))


def _table(verdict: Verdict, name: str, table: pl.DataFrame, *, odometer: bool) -> None:
    for column in table.select(pl.col(pl.Float32, pl.Float64)):
        if not column.is_finite().all():
            verdict.says("nan", f"{name}: {column.name}")
    if {"covariance_xx_m2", "covariance_xy_m2", "covariance_yy_m2"} <= set(table.columns):
        _covariances(verdict, name, table.drop_nulls("covariance_xx_m2"))
    if {"true_x_m", "integrity"} <= set(table.columns):
        _honesty(verdict, table)
        if odometer:
            _leaps(verdict, table.drop_nulls("covariance_xx_m2"))


def _covariances(verdict: Verdict, name: str, table: pl.DataFrame) -> None:
    """Checks that variances are not negative, and correlation matrices positive semidefinite."""
    axes = ("xx_m2", "xy_m2", "x_heading_m_rad", "yy_m2", "y_heading_m_rad", "heading_rad2")
    if "covariance_x_heading_m_rad" not in table.columns:
        axes = ("xx_m2", "xy_m2", "yy_m2")
    size = 3 if len(axes) == 6 else 2
    upper = np.triu_indices(size)
    matrices = np.zeros((table.height, size, size))
    for row, column, axis in zip(*upper, axes, strict=True):
        matrices[:, row, column] = matrices[:, column, row] = table[f"covariance_{axis}"]
    variances = np.diagonal(matrices, axis1=1, axis2=2)
    if (variances < 0.0).any():
        verdict.says("variance", f"{name}: {variances.min()} at row {variances.min(1).argmin()}")
    sigmas = np.sqrt(np.where(variances > 0.0, variances, 1.0))
    least = np.linalg.eigvalsh(matrices / (sigmas[:, :, None] * sigmas[:, None, :]))[:, 0]
    if least.size and least.min() < ROUNDING:
        verdict.says("variance", f"{name}: eigenvalue {least.min():.1e} at row {least.argmin()}")


def _honesty(verdict: Verdict, table: pl.DataFrame) -> None:
    """Checks the errors of ``ok`` epochs against `NONSENSE_M` and the protection level."""
    error_m = (pl.col("error_x_m") ** 2 + pl.col("error_y_m") ** 2).sqrt()
    ok = table.filter(integrity="ok").select(error_m=error_m, level_m="protection_level_m")
    verdict.ok, verdict.beyond = ok.height, int((ok["error_m"] > ok["level_m"]).sum())
    if not ok.is_empty() and float(ok["error_m"].max()) > NONSENSE_M:  # type: ignore[arg-type]
        verdict.says("nonsense", f"{ok['error_m'].max():.0f} m off while ok")


def _leaps(verdict: Verdict, table: pl.DataFrame) -> None:
    """Checks that no pose moves farther in one step than odometer and covariance allow."""
    steps = np.diff(table.select("x_m", "y_m", "true_x_m", "true_y_m").to_numpy(), axis=0)
    moved_m, driven_m = np.hypot(steps[:, 0], steps[:, 1]), np.hypot(steps[:, 2], steps[:, 3])
    xx, xy, yy = (table[f"covariance_{axis}_m2"].to_numpy() for axis in ("xx", "xy", "yy"))
    sigma_m = np.sqrt(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy))
    most_m = MOST_READ * driven_m + LEAP_SIGMAS * np.maximum(sigma_m[1:], sigma_m[:-1])
    leaps = np.flatnonzero((np.diff(table["run"]) == 0) & (moved_m > most_m))
    if leaps.size:
        worst = leaps[np.argmax((moved_m - most_m)[leaps])]
        verdict.says(
            "leap",
            f"{leaps.size} steps; {moved_m[worst]:.2f} m of {most_m[worst]:.2f} m "
            f"at {table['time_s'][int(worst) + 1]} s",
        )
