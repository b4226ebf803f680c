"""Report of ``access-av study``: verdict, map, remedies, operating point and cost of one plant."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING, Any

from access_av._core import ERROR_CORRELATION_S
from access_av.report import study_charts as charts
from access_av.report.page import VERSION, sheet
from access_av.report.parts import (
    badge,
    code,
    figure,
    folded,
    records,
    section,
    small,
    source,
    table,
    warnings,
)  # fmt: skip
from access_av.report.played import CAPTION as PLAYED
from access_av.report.study_operation import money_section, operation_section
from access_av.report.study_parts import (
    digits,
    ends,
    joules,
    lost,
    reliability_rows,
    sources,
)  # fmt: skip
from access_av.run.assumptions import in_words, optimistic_assumptions
from access_av.settings import as_dict
from access_av.study import economy
from access_av.tables.numbers import count

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.report.chart import Spec
    from access_av.study.study_result import Study

# Maximum number of rows of the table along the road.
MOST_PLACES = 30


def render_study(study: Study, appendix: str = "") -> str:
    """Returns a study as a self-contained HTML page.

    Parameters
    ----------
    study
        Result of :func:`access_av.study_plant`.
    appendix
        HTML section with the comparison of variants.
    """
    specs: dict[str, Spec] = {
        "map": charts.road_map(study),
        "along": charts.along_road(study),
        "signal": charts.signal_along_road(study),
    }
    if study.points:
        specs["ways"] = charts.ways_to_operate(study)
    assumed = in_words(optimistic_assumptions(study.nominal.scenario))
    described = f"{study.plant.description}." if study.plant.description else ""
    return sheet(
        specs,
        "study",
        study.plant.name,
        kicker=f"ACCESS-AV study: {study.plant.name}",
        headline=_headline(study),
        lead=f"{study.verdict} {described} {assumed}".strip(),
        tiles=_tiles(study),
        meta=f"Simulated: {study.nominal.runs} trips of {study.nominal.duration_s:.0f} s with the "
        f"nominal channel, seed {study.seed}, {VERSION}. Intervals: 95 %.",
        sections=[
            warnings(study.plant.warnings()),
            _verdict(study),
            _where(study),
            _remedies(study),
            operation_section(study),
            money_section(study),
            appendix,
            _unverified(study),
            section(
                "Provenance",
                "errors.parquet, drives.parquet, targets.parquet, places.csv, points.parquet and "
                "trajectories.parquet (the drive that is played) next to this page contain the "
                "data of its figures.",
                source("Plant, all defaults written out", study.plant.to_toml()),
            ),
        ],
    )


def _headline(study: Study) -> str:
    judged = study.judged(study.nominal).words
    stretches = len(study.targets.each) - 1
    more = f", and {count(stretches, 'target')} of stretches" if stretches else ""
    return (
        f"{judged[0].upper()}{judged[1:]} for {study.error_m:g}\N{NO-BREAK SPACE}m, "
        f"{study.percent:g}\N{NO-BREAK SPACE}% of the "
        f"time{more}"
    )


def _tiles(study: Study) -> list[tuple[str, str]]:
    nominal, poor_los = (
        it.percentile(study.percent).value for it in (study.nominal, study.poor_los)
    )
    within = f"error that the vehicle does not exceed for {study.percent:g} % of time"
    made = [
        (f"{nominal:.2f} m", within),
        (f"{poor_los:.2f} m", "the same percentile with poor line of sight"),
    ]
    if lost_runs := study.nominal.lost_runs:
        made.insert(0, (f"{lost_runs} of {study.nominal.runs}", "drives LOST"))
    if study.point is not None:
        made.append(
            (
                joules(economy.trip_j(study.point).central),
                "a trip at the recommended point, above idle",
            )
        )
    if study.day is not None:
        made.append(
            (
                f"{digits(study.day.trips_wh.central)} Wh",
                "the fleet’s day at that point, above idle",
            )
        )
    if study.nominal.ok_share is not None:
        made.append((f"{study.nominal.ok_share:.1%}", "of the time in state ok"))
    return made


def _interval(values: tuple[float, float, float]) -> str:
    return f"{values[1]:.2%} to {values[2]:.2%}"


def _verdict(study: Study) -> str:
    rows: list[tuple[str, ...]] = []
    for name, driven in (("nominal", study.nominal), ("poor line of sight", study.poor_los)):
        for number, it in enumerate(study.results(driven)):
            stretch = f"{it.target.from_m:.0f} to {it.target.to_m:.0f} m along the road"
            rows.append(
                (
                    small(it.target.name, f"{name}, {stretch}"),
                    lost(driven) if number == 0 else "–",
                    it.target.words.replace(" %", "\N{NO-BREAK SPACE}%"),
                    f"{it.error.value:.3f} m",
                    f"{it.error.interval} m",
                    f"{it.share[0]:.2%}",
                    _interval(it.share),
                    badge(it.judgement.words, it.judgement.badge),
                )
            )
        if len(study.targets.each) > 1:
            judged = study.judged(driven)
            verdict = badge(judged.words, judged.badge)
            rows.append((small("all targets", name), *(["–"] * 6), verdict))
    head = (
        "Target", "Lost drives", "Required", "Percentile", "95 % interval", "Share within",
        "95 % interval", "Verdict",
    )  # fmt: skip
    written = as_dict(study.plant)
    channel = written["poor_channel"]["model"]
    return section(
        "Is it good enough?",
        "Every value with a standard deviation is drawn for each drive. “Good enough”: the whole "
        "95 % interval of the share of time within the error meets the target; “not good enough”: "
        "the whole interval misses it; “probably”: only the estimate meets or misses it. All "
        "targets are met if each one is. “Above”: the drives are too few for an upper end. "
        f"Poor line of sight: channel model “{channel}” of TR 38.901.",
        table(head, rows, numbers=range(3, 7)) + _integrity(study, written),
    )


def _integrity(study: Study, written: Mapping[str, Any]) -> str:
    """Returns the section on the reliability of the position, with its settings."""
    integrity = written["vehicle"].get("integrity") or {}
    follows = math.isclose(study.alert_limit_m, 2.0 * study.error_m)
    limit = f"alert limit {study.alert_limit_m:g} m"
    limit += f" (twice the target’s {study.error_m:g} m)" if follows else " (set in the vehicle)"
    risk = integrity.get("risk_per_hour")
    settings = [limit]
    if risk is not None:
        settings.append(f"integrity risk {risk:g} per hour")
    settings.append(f"error correlation {ERROR_CORRELATION_S:g} s")
    drives = [study.nominal.named("nominal"), study.poor_los, *(it.driven for it in study.remedies)]
    of_points = {it.driven.name: it.driven for it in study.points}
    drives += [it for name, it in of_points.items() if name != study.nominal.name]
    rows = reliability_rows(drives)
    first = 2  # the other rows are collapsed
    tables = (records(it, numbers=range(1, 7)) for it in (rows[:first], rows[first:]))
    return (
        f"<h3>Reliability</h3><p>Integrity settings: {escape(', '.join(settings))}. State ok: the "
        "protection level is below the alert limit, and no fault is suspected. Otherwise: share of "
        "the time by reason. Errors while ok: SSBs whose error exceeds the protection level.</p>"
        + next(tables)
        + folded("Measures and operations", next(tables))
    )


def _where(study: Study) -> str:
    worst = [
        {
            "": str(number),
            "Along the road": f"{place.along_m:.0f} m",
            "Position": f"({place.x_m:.0f}, {place.y_m:.0f}) m",
            f"{study.percent:g} % within": f"{place.error_m:.2f} m",
            "Why": place.why,
        }
        for number, place in enumerate(study.worst, start=1)
    ]
    sides = [
        {
            "Radio head": it["name"],
            "nearest point of the road": f"{it['along_m']:.0f} m",
            "distance and side of the road": f"{it['distance_m']:.0f} m to the {it['side']}",
        }
        for it in study.heads.iter_rows(named=True)
    ]
    kept = study.places["passes"].sum() / study.places.height
    return section(
        "Where is the error too large?",
        f"Colour of the road: {study.percent:g}th percentile of the error within 5 m of each "
        f"position; "
        f"{kept:.0%} of the road meet the target of the whole trip. Triangles: radio heads; "
        "squares: stops; diamonds: targets of positions and stretches; grey lines: walls; numbers: "
        f"worst positions. places.csv has each metre. Drawn to scale on a wide screen. {PLAYED}",
        figure("map")
        + records(worst, numbers=(1, 2, 3))
        + records(sides, numbers=(1, 2))
        + '<div class="charts">'
        + figure(
            "along",
            "Levels are protection levels in state ok. The minimum RMS error is the lower bound "
            "for any localizer. Dashed: the target.",
            "Error along the road",
        )
        + figure(
            "signal",
            "Dilution: along-road error in metres for an error of one degree in every angle. It "
            "depends on the geometry only; the position error also depends on the odometer.",
            "Geometry and signal",
        )
        + f"</div>{_places(study)}",
    )


def _places(study: Study) -> str:
    """Returns the data of the charts along the road as a collapsible table."""
    step = math.ceil(study.places.height / MOST_PLACES)
    rows = [
        {
            "Along the road": f"{place['along_m']:.0f} m",
            "Target": badge("kept", "yes") if place["passes"] else badge("missed", "no"),
            f"{study.percent:g} % within": f"{place['target_error_m']:.3f} m",
            "median error": f"{place['median_error_m']:.3f} m",
            "protection level": "–" if place["level_m"] is None else f"{place['level_m']:.2f} m",
            "state ok": f"{place['reliable_share']:.0%}",
            "minimum RMS": f"{place['bound_m']:.3f} m",
            "dilution": "–"
            if (it := place["along_road_error_per_degree_m"]) is None
            else f"{it:.2f} m",
            "SNR": "–" if (it := place["best_snr_db"]) is None else f"{it:.0f} dB",
        }
        for place in study.places.gather_every(step).iter_rows(named=True)
    ]
    return folded(f"These figures every {step} m", records(rows, numbers=range(2, 9)))


def _remedies(study: Study) -> str:
    if study.measured is None:
        text = "The drives meet all targets: no measure was simulated. "
        return section("What reduces the error?", f"{text}--force-remedies simulates them.", "")
    currency = study.prices.currency
    measured = study.measured
    before = measured.before
    base = before.percentile(study.percent)
    judged = study.judged(before)
    rows = [
        (
            "without any measure",
            lost(before),
            small(f"{base.value:.3f} m", f"{base.interval} m"),
            *(["–"] * 3),
            badge(judged.words, judged.badge),
        )
    ]
    for it in measured.every:
        delta, low, high = it.delta_m
        per_price = it.cm_per_price
        rows.append(
            (
                small(it.name, it.what),
                lost(it.driven),
                small(f"{it.error.value:.3f} m", f"{it.error.interval} m"),
                small(f"{delta:+.3f} m", f"{low:+.3f} to {high:+.3f} m: {it.effect.words}"),
                ends(it.cost),
                "–" if per_price is None else f"{per_price:.2g}",
                badge(it.judgement.words, it.judgement.badge),
            )
        )
    head = (
        "Measure", "Lost drives", f"{study.percent:g} % within", "difference to the first row",
        f"price / {currency}", f"cm per {currency}", "targets",
    )  # fmt: skip
    cheapest = measured.cheapest
    best = min(measured.every, key=lambda it: it.error.value)
    text = (
        f"Cheapest of the simulated measures: {cheapest.name}, {cheapest.judgement.words} "
        f"({cheapest.error.value:.2f} m, {ends(cheapest.cost)} {study.prices.currency})."
        if cheapest is not None
        else "None of the simulated measures meets, or probably meets, all targets; the most "
        f"effective one is {best.name}, {best.error.value:.2f} m."
    )
    return section(
        "What reduces the error?",
        f"{text} All rows use equal environments, {before.runs} drives each. Helps: "
        "the 95 % interval of the difference is below zero. Sets of measures are simulated from "
        "the cheapest on, if the product of their error ratios could meet the target.",
        table(head, rows, numbers=range(2, 6))
        + sources(study, [one.price for it in measured.every for one in it.remedies]),
    )


def _unverified(study: Study) -> str:
    rows = [
        {
            "Key": code(it.key),
            "Value": it.what,
            "Alternative": it.otherwise or "–",
            "effect on the bound": "no effect on the error"
            if it.effect is None
            else f"{100.0 * (it.effect - 1.0):+.0f} %",
        }
        for it in study.unverified
    ]
    text = (
        "These values are equal to the template’s or the default, the most influential first. "
        "Effect: change of the least error that any localizer can reach (90th percentile along "
        "the road) with the alternative."
    )
    none = "No value is equal to the template’s."
    return section("Unverified values", text if rows else none, records(rows, numbers=(3,)))
