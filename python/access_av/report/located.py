"""Report of ``access-av record locate``: track, error, innovations, estimated parameters."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import polars as pl

from access_av.drives import recorded as drives
from access_av.report import located_charts as charts
from access_av.report.page import VERSION, sheet
from access_av.report.parts import figure, section, source, table, warnings
from access_av.report.played import CAPTION as PLAYED
from access_av.run.operation import Operation
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from access_av._core import Site, Vehicle
    from access_av.drives.recorded import Drive
    from access_av.report.chart import Spec

MOST_REMARKS = 50
UNRELIABLE = "Not reliable"
TRACK_TEXT = "Track of the vehicle in the map frame, to scale on a wide screen. " + PLAYED


def render_located(
    drive: Drive,
    site: Site,
    vehicle: Vehicle,
    numbers: dict[str, float],
    truth: pl.DataFrame | None = None,
    appendix: str = "",
) -> str:
    """Returns a located drive as a self-contained HTML page.

    Parameters
    ----------
    drive
        Result of :func:`access_av.locate`.
    site, vehicle
        Nominal settings.
    numbers
        Result of :func:`access_av.drives.summary`.
    truth
        Result of :func:`access_av.drives.read_tum`, if the truth is known.
    appendix
        HTML section with the comparison of variants.
    """
    specs: dict[str, Spec] = {}
    sections = []
    operation = Operation.under(vehicle, drive.poses)
    if operation is not None:
        description = f"{operation.in_words()} {operation.what_helps()}".strip()
        sections.append(section("Operation", description, ""))
    if drive.remarks:
        sections.append(section("Remarks", "", _list(drive.remarks)))
    known = drive.poses.filter(~pl.col("searching"))
    if not known.is_empty():
        specs["track"] = charts.track(
            drive, _tracks(drive, known, truth), site, _steps(drive, truth)
        )
        specs["error"] = charts.error(_errors(drive, known, truth))
        sections += [
            section("Track", TRACK_TEXT, figure("track")),
            section("Error", _error_text(drive, numbers), figure("error")),
        ]
    if not drive.findings.is_empty():
        sections.append(
            section(
                "Estimated vehicle parameters",
                "Estimates at the end of the drive, and the nominal values of the vehicle file.",
                _findings(drive.findings),
            )
        )
    if not drive.angles.is_empty():
        compared, places = _compared(drive.angles), ""
        if not compared.is_empty():
            specs |= {"angles": charts.angles(compared), "heads": charts.heads(compared)}
            places = figure("angles") + figure("heads", title="Each radio head")
        sections.append(
            section(
                "Angles",
                "Innovation of each angle divided by its standard deviation. With a correct model, "
                "90 % are below the dashed line.",
                places + _by_head(drive.angles),
            )
        )
    nominal = source("Site with all default values", site.to_toml())
    nominal += source("Vehicle with all default values", vehicle.to_toml())
    return sheet(
        specs,
        "located drive",
        headline=_headline(drive, numbers),
        lead=f"{drive.suspicions[0]}." if drive.suspicions else "",
        tiles=_tiles(drive, numbers),
        meta=f"{VERSION.capitalize()}.",
        sections=[
            warnings(site.warnings(vehicle)),
            *sections,
            appendix,
            section("Provenance", "", nominal),
        ],
    )


def _headline(drive: Drive, numbers: dict[str, float]) -> str:
    if not drive.is_reliable:
        return UNRELIABLE
    if "p90_error_m" in numbers:
        return f"90 % of the errors are below {numbers['p90_error_m']:.2f} m"
    return f"{numbers['angles']:,.0f} angles in {numbers['duration_s']:.0f} s"


def _tiles(drive: Drive, numbers: dict[str, float]) -> list[tuple[str, str]]:
    share = numbers["accepted"] / max(1.0, numbers["angles"])
    tiles = {
        "duration": f"{numbers['duration_s']:.1f} s",
        "angles": f"{numbers['angles']:,.0f}",
        "accepted angles": f"{share:.1%}",
    }
    if drive.lost_share:
        tiles["share of time lost"] = f"{drive.lost_share:.1%}"
    for name, text in {
        "rms_error_m": "RMS of the horizontal error",
        "p90_error_m": "90th percentile of the horizontal error",
        "smoothed_rms_error_m": "RMS of the smoothed error",
    }.items():
        if name in numbers:
            tiles[text] = f"{numbers[name]:.3f} m"
    if "nees_per_axis" in numbers:
        tiles["NEES per axis (expected: 1)"] = f"{numbers['nees_per_axis']:.2f}"
    if "beyond_while_ok" in numbers and drive.poses["integrity"].null_count() == 0:
        tiles["availability (state ok)"] = f"{numbers['ok_share']:.1%}"
        tiles["of the time ok with an error above the protection level"] = (
            f"{numbers['beyond_while_ok']:.2%}"
        )
    return [(value, text) for text, value in tiles.items()]


def _tracks(
    drive: Drive, known: pl.DataFrame, truth: pl.DataFrame | None
) -> dict[str, pl.DataFrame]:
    during = pl.col("time_s").is_between(drive.poses["time_s"][0], drive.poses["time_s"][-1])
    lines = {"truth": truth.filter(during)} if truth is not None else {}
    lines["as driven"] = known
    if drive.smoothed is not None and not drive.smoothed.is_empty():
        lines["smoothed"] = drive.smoothed
    return lines


def _errors(
    drive: Drive, known: pl.DataFrame, truth: pl.DataFrame | None
) -> dict[str, pl.DataFrame]:
    lines = {}
    if truth is not None:
        lines["error"] = drives.error_m(known, truth)
        if drive.smoothed is not None and not drive.smoothed.is_empty():
            lines["error, smoothed"] = drives.error_m(drive.smoothed, truth)
    deviation = (pl.col("covariance_xx_m2") + pl.col("covariance_yy_m2")).sqrt()
    lines["deviation"] = known.select("time_s", error_m=deviation)
    if known["protection_level_m"].null_count() < known.height:
        lines["protection level"] = known.select("time_s", error_m="protection_level_m")
    return lines


def _error_text(drive: Drive, numbers: dict[str, float]) -> str:
    text = "Standard deviation of the position by the localizer's covariance"
    if "rms_error_m" in numbers:
        text += ", and the error against the truth"
    if drive.poses["integrity"].null_count() < drive.poses.height:
        text += (
            "; in state ok the error is below the protection level with the target integrity risk"
        )
    return text + "."


def _steps(drive: Drive, truth: pl.DataFrame | None) -> pl.DataFrame:
    """Returns the located poses for the animation, with errors if the truth is known."""
    poses = drive.poses.select(
        "time_s", "x_m", "y_m", "searching", "integrity", "protection_level_m"
    )
    if truth is None:
        return poses.with_columns(error_m=pl.lit(None, pl.Float64))
    off = drives.error_m(drive.poses, truth).select("time_s", "error_m")
    return poses.join(off, on="time_s", how="left", maintain_order="left")


def _compared(angles: pl.DataFrame) -> pl.DataFrame:
    several_beams = angles["ssb_index"].n_unique() > 1
    head = (
        pl.format("{}/{}", "pci", "ssb_index") if several_beams else pl.col("pci").cast(pl.String)
    )
    return angles.drop_nulls("mahalanobis_squared").select(
        "time_s",
        "pci",
        "ssb_index",
        head=head,
        deviations=pl.col("mahalanobis_squared").sqrt(),
        verdict=pl.when("accepted").then(pl.lit("accepted")).otherwise(pl.lit("refused")),
    )


def _by_head(angles: pl.DataFrame) -> str:
    reasons = (
        angles.group_by("pci", "ssb_index", "reason")
        .agg(pl.len(), nis=pl.col("mahalanobis_squared").mean())
        .sort("pci", "ssb_index", "reason")
    )
    rows = [
        (str(pci), str(index), reason, f"{count:,}", number(nis, 2))
        for pci, index, reason, count, nis in reasons.iter_rows()
    ]
    head = ("PCI", "SSB", "Verdict", "Angles", "Mean squared deviations")
    return table(head, rows, numbers=(0, 1, 3, 4))


def _findings(findings: pl.DataFrame) -> str:
    rows = [
        (
            quantity,
            f"{stated:.4f}",
            f"{found:.4f} ± {std:.4f}" if std else "taken as exact",
            unit,
        )
        for quantity, unit, stated, found, std in findings.iter_rows()
    ]
    return table(("Quantity", "Stated", "Found", "Unit"), rows, numbers=(1, 2))


def _list(remarks: list[str]) -> str:
    items = "".join(f"<li>{escape(remark)}</li>" for remark in remarks[:MOST_REMARKS])
    more = len(remarks) - MOST_REMARKS
    return f"<ul>{items}</ul>" + (f"<p>{more} more.</p>" if more > 0 else "")
