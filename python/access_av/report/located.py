"""The page of ``access-av locate``: where the vehicle was, and how well that is known."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.report.chart import BLUE, ORANGE, finish, thinned
from access_av.report.page import sheet
from access_av.report.parts import figure, source, table, tile

if TYPE_CHECKING:
    from access_av._core import Site, Vehicle
    from access_av.drives import Drive
    from access_av.report.chart import Spec

MOST_REMARKS = 50


def render_located(drive: Drive, site: Site, vehicle: Vehicle, numbers: dict[str, float]) -> str:
    """A located drive as an HTML page that loads nothing.

    Parameters
    ----------
    drive
        What :func:`access_av.locate` returned.
    site, vehicle
        What was believed of both.
    numbers
        What :func:`access_av.drives.summary` returned.
    """
    known = drive.poses.filter(~pl.col("searching"))
    lines = {"as driven": known}
    if drive.smoothed is not None and not drive.smoothed.is_empty():
        lines["smoothed"] = drive.smoothed
    specs = {"track": _track(lines), "sigma": _sigma(lines)}
    sections = [
        _section("Track", "Where the vehicle was, in the map's frame.", figure("track")),
        _section(
            "Uncertainty",
            "Standard deviation of the position by the localizer's own covariance.",
            figure("sigma"),
        ),
    ]
    if not drive.angles.is_empty():
        specs["angles"] = _angles(drive.angles)
        sections.append(
            _section(
                "Angles",
                "Squared Mahalanobis distance of each angle from what was expected.",
                figure("angles") + _reasons(drive.angles),
            )
        )
    if drive.remarks:
        listed = "\n".join(drive.remarks[:MOST_REMARKS])
        sections.append(
            _section(
                "Remarks",
                f"{len(drive.remarks)} items of the input were remarkable.",
                source("The first of them", listed),
            )
        )
    believed = source("Site, all defaults written out", site.to_toml())
    believed += source("Vehicle, all defaults written out", vehicle.to_toml())
    sections.append(_section("Provenance", "", believed))
    share = numbers["accepted"] / max(1.0, numbers["angles"])
    tiles = [
        tile(f"{numbers['duration_s']:.1f} s", "duration"),
        tile(f"{numbers['angles']:,.0f}", "angles"),
        tile(f"{share:.1%}", "of them accepted"),
    ]
    headline = f"{numbers['angles']:,.0f} angles in {numbers['duration_s']:.0f} s"
    if "rms_error_m" in numbers:
        headline = f"{numbers['p90_error_m']:.2f} m or less in nine of ten epochs"
        tiles.append(tile(f"{numbers['rms_error_m']:.3f} m", "RMS of the horizontal error"))
        tiles.append(tile(f"{numbers['p90_error_m']:.3f} m", "its 90th percentile"))
    return sheet(
        specs,
        title="ACCESS-AV located drive",
        kicker="ACCESS-AV located drive",
        headline=headline,
        lead="",
        tiles="".join(tiles),
        meta=escape(f"Version {version('access-av')}."),
        sections="".join(sections),
    )


def _section(title: str, text: str, body: str) -> str:
    return f"<section><h2>{escape(title)}</h2><p>{escape(text)}</p>{body}</section>"


def _track(lines: dict[str, pl.DataFrame]) -> Spec:
    chart = (
        alt.Chart(_together(lines, pl.col("x_m"), pl.col("y_m")))
        .mark_line(strokeWidth=2)
        .encode(
            x=alt.X("x_m:Q", title="x / m", scale=alt.Scale(zero=False)),
            y=alt.Y("y_m:Q", title="y / m", scale=alt.Scale(zero=False)),
            order="time_s:Q",
            color=_line_colour(lines),
        )
    )
    return finish(chart, height=300, description="Track of the vehicle")


def _sigma(lines: dict[str, pl.DataFrame]) -> Spec:
    sigma_m = (pl.col("covariance_xx_m2") + pl.col("covariance_yy_m2")).sqrt().alias("sigma_m")
    chart = (
        alt.Chart(_together(lines, sigma_m))
        .mark_line(strokeWidth=2)
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("sigma_m:Q", title="standard deviation / m"),
            color=_line_colour(lines),
        )
    )
    return finish(chart, height=220, description="Standard deviation of the position against time")


def _together(lines: dict[str, pl.DataFrame], *columns: pl.Expr) -> pl.DataFrame:
    return pl.concat(
        thinned(poses.select("time_s", *columns)).with_columns(line=pl.lit(name))
        for name, poses in lines.items()
    )


def _line_colour(lines: dict[str, pl.DataFrame]) -> alt.Color:
    scale = alt.Scale(domain=list(lines), range=[BLUE, ORANGE][: len(lines)])
    legend = alt.Legend(title=None) if len(lines) > 1 else None
    return alt.Color("line:N", scale=scale, legend=legend)


def _angles(angles: pl.DataFrame) -> Spec:
    seen = thinned(
        angles.drop_nulls("mahalanobis_squared").select(
            "time_s",
            "mahalanobis_squared",
            verdict=pl.when("accepted").then(pl.lit("accepted")).otherwise(pl.lit("refused")),
        )
    )
    dots = (
        alt.Chart(seen)
        .mark_circle(size=18, opacity=0.7)
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("mahalanobis_squared:Q", title="distance²", scale=alt.Scale(type="symlog")),
            color=alt.Color(
                "verdict:N",
                scale=alt.Scale(domain=["accepted", "refused"], range=[BLUE, ORANGE]),
                legend=alt.Legend(title=None),
            ),
        )
    )
    return finish(dots, height=220, description="Distance of each angle from what was expected")


def _reasons(angles: pl.DataFrame) -> str:
    counted = angles.group_by("pci", "ssb_index", "reason").len().sort("pci", "ssb_index", "reason")
    rows = [
        (str(pci), str(index), escape(reason), f"{count:,}")
        for pci, index, reason, count in counted.iter_rows()
    ]
    return table(("PCI", "SSB", "Verdict", "Angles"), rows, numbers=(0, 1, 3))
