"""The page of ``access-av study``: one plant's question, and everything its answer needs."""

from __future__ import annotations

import json
import math
from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING

from access_av.report import study_charts as charts
from access_av.report.page import sheet
from access_av.report.parts import badge, figure, section, source, table, tile, warnings
from access_av.report.played import CAPTION as PLAYED
from access_av.run.assumptions import energy_boundary, flattering, in_words
from access_av.study import economy

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.economics.carbon import Range
    from access_av.report.chart import Spec
    from access_av.study.answer import Study
    from access_av.study.points import Point

# Rows of the table along the road.
MOST_PLACES = 30


def render_study(study: Study, beside: str = "") -> str:
    """A study as an HTML page that loads nothing.

    Parameters
    ----------
    study
        What :func:`access_av.study_plant` returned.
    beside
        A section on other variants, as HTML.
    """
    specs: dict[str, Spec] = {
        "map": charts.road_map(study),
        "along": charts.along_road(study),
        "signal": charts.signal_along_road(study),
    }
    if study.points:
        specs["ways"] = charts.ways_to_operate(study)
    scenario = study.believed.scenario
    assumed = in_words(flattering(scenario))
    described = f"{study.plant.description}." if study.plant.description else ""
    return sheet(
        specs,
        title=f"ACCESS-AV study: {escape(study.plant.name)}",
        kicker=f"ACCESS-AV study: {escape(study.plant.name)}",
        headline=_headline(study),
        lead=escape(f"{study.verdict} {described} {assumed}".strip()),
        tiles=_tiles(study),
        meta=escape(
            f"Simulated: {study.believed.runs} trips of {study.believed.duration_s:.0f} s as "
            f"believed, seed {study.seed}, version {version('access-av')}. Intervals are of 95 %."
        ),
        sections=warnings(study.plant.warnings())
        + _verdict(study)
        + _where(study)
        + _remedies(study)
        + _operation(study)
        + _money(study)
        + beside
        + _unstated(study)
        + section(
            "Provenance",
            "errors.parquet, drives.parquet, places.csv, points.parquet and trajectories.parquet "
            "(the drive that is played) beside this page hold what its figures are made of.",
            source("Plant, all defaults written out", study.plant.to_toml()),
        ),
    )


def _headline(study: Study) -> str:
    judged = study.judged(study.believed).words
    return escape(
        f"{judged[0].upper()}{judged[1:]} for {study.error_m:g} m, {study.percent:g} % of the time"
    )


def _tiles(study: Study) -> str:
    believed, poor = (it.percentile(study.percent).value for it in (study.believed, study.poor))
    made = [
        tile(
            f"{believed:.2f} m", f"{study.percent:g} % of the time the error is within, as believed"
        ),
        tile(f"{poor:.2f} m", "the same where lines of sight are poor"),
    ]
    if study.point is not None:
        made.append(tile(_joules(economy.trip_j(study.point).central), "a trip, above idle"))
    if study.day is not None:
        made.append(tile(f"{_number(study.day.trips_wh.central)} Wh", "a fleet’s day, above idle"))
    if study.believed.ok_share is not None:
        made.append(
            tile(f"{study.believed.ok_share:.1%}", "of the time the position may be relied on")
        )
    return "".join(made)


def _verdict(study: Study) -> str:
    rows = []
    for name, driven in (
        ("as it is believed", study.believed),
        ("poor line of sight", study.poor),
    ):
        share, low, high = driven.within(study.error_m)
        found = driven.percentile(study.percent)
        judged = study.judged(driven)
        rows.append(
            (
                escape(name),
                f"{found.value:.3f} m",
                f"{escape(found.interval)} m",
                f"{share:.2%}",
                f"{low:.2%} to {high:.2%}",
                "–" if driven.ok_share is None else f"{driven.ok_share:.1%}",
                str(driven.runs),
                badge(judged.words, judged.badge),
            )
        )
    channel = json.loads(study.plant.to_json())["poor_channel"]["model"]
    head = (
        "Line of sight", f"{study.percent:g} % within", "interval", f"within {study.error_m:g} m",
        "interval of that", "reliable", "drives", "",
    )  # fmt: skip
    return section(
        "Is it good enough?",
        "Whatever is stated with a standard deviation was drawn anew for each drive. Good enough, "
        "or not, is what the interval of the share within says; probably, what its middle says. "
        f"Poor line of sight is the channel model “{channel}” of TR 38.901. Reliable: state ok, "
        "the protection level below the alert limit.",
        table(head, rows, numbers=range(1, 7)),
    )


def _where(study: Study) -> str:
    rows = [
        (
            str(number),
            f"{place.along_m:.0f} m",
            f"({place.x_m:.0f}, {place.y_m:.0f}) m",
            f"{place.error_m:.2f} m",
            escape(place.why),
        )
        for number, place in enumerate(study.worst, start=1)
    ]
    kept = study.places["passes"].sum() / study.places.height
    head = ("", "Along the road", "Place", f"{study.percent:g} % within", "Why")
    return section(
        "Where is it not?",
        f"The road is coloured by the error that {study.percent:g} % of the positions within 5 m "
        f"of a place are within; {kept:.0%} of the road keep the target. Triangles are radio "
        "heads, squares stops, grey lines walls, numbers the worst places. places.csv has each "
        "metre. "
        f"Drawn to scale on a wide screen. {PLAYED}",
        figure("map")
        + table(head, rows, numbers=(1, 2, 3))
        + '<div class="charts">'
        + figure(
            "along",
            "Levels are protection levels while the position may be relied on; the least RMS error "
            "is that of any localizer. Dashed: the target.",
            "Error along the road",
        )
        + figure(
            "signal",
            "Dilution: by how many metres an error of one degree in every angle shows along the "
            "road. It is geometry alone; the error is what the odometer makes of it besides.",
            "Geometry and signal",
        )
        + f"</div>{_places(study)}",
    )


def _places(study: Study) -> str:
    """What the charts along the road show, as a table to unfold."""
    step = math.ceil(study.places.height / MOST_PLACES)
    rows = [
        (
            f"{place['along_m']:.0f} m",
            badge("kept", "yes") if place["passes"] else badge("missed", "no"),
            f"{place['target_error_m']:.3f} m",
            f"{place['median_error_m']:.3f} m",
            "–" if place["level_m"] is None else f"{place['level_m']:.2f} m",
            f"{place['reliable_share']:.0%}",
            f"{place['bound_m']:.3f} m",
            "–" if (it := place["dilution_of_degree_m"]) is None else f"{it:.2f} m",
            "–" if (it := place["best_snr_db"]) is None else f"{it:.0f} dB",
        )
        for place in study.places.gather_every(step).iter_rows(named=True)
    ]
    head = (
        "Along the road", "Target", f"{study.percent:g} % within", "half within", "level",
        "reliable", "least RMS", "dilution", "SNR",
    )  # fmt: skip
    return (
        f"<details><summary>These figures every {step} m</summary>"
        f"{table(head, rows, numbers=range(2, 9))}</details>"
    )


def _remedies(study: Study) -> str:
    if not study.mended:
        return section(
            "What would mend it?",
            "The drives keep the target: no remedy was driven. With --always-mend they are.",
            "",
        )
    currency = escape(study.prices.currency)
    base = study.believed.percentile(study.percent)
    rows = [("as it is", f"{base.value:.3f} m", f"{escape(base.interval)} m", "–", "–", "–", "")]
    for it in study.mended:
        delta, low, high = it.delta_m
        rows.append(
            (
                f"{escape(it.remedy.name)}<small>{escape(it.remedy.what)}</small>",
                f"{it.error.value:.3f} m",
                f"{escape(it.error.interval)} m",
                f"{delta:+.3f} m",
                f"{low:+.3f} to {high:+.3f} m",
                _range(it.cost),
                badge(it.effect.words, it.effect.badge),
            )
        )
    head = (
        "Remedy", f"{study.percent:g} % within", "interval", "difference", "interval of that",
        f"price / {currency}", "",
    )  # fmt: skip
    pairs = study.mended[0].driven.runs
    keeping = [it for it in study.mended if it.error.value <= study.error_m]
    least = min(keeping, key=lambda it: it.cost.central, default=None)
    best = study.mended[0]
    text = (
        f"The one of least price that keeps the target here: {least.remedy.name} "
        f"({least.error.value:.2f} m)."
        if least is not None
        else f"None of them alone keeps the target; the best is to {best.remedy.name}, "
        f"{best.error.value:.2f} m."
    )
    return section(
        "What would mend it?",
        f"{text} Each by itself, driven in the same {pairs} worlds as the plant as it is; helps is "
        "what is surely better than that.",
        table(head, rows, numbers=range(1, 6))
        + _sources(study, [it.remedy.price for it in study.mended]),
    )


def _operation(study: Study) -> str:
    point = study.point
    if point is None or study.day is None:
        return section("How to operate it", "The vehicle’s platform has no figure of energy.", "")
    boundary = energy_boundary(point.driven.scenario) or "unstated"
    idle = study.day.idle_wh
    text = (
        f"Recommended: {point.name}. It takes {_joules_range(economy.trip_j(point))} a trip, which "
        f"is {_range(study.day.trips_wh)} Wh a day for the fleet. Boundary: {boundary}; receiver "
        "and estimates, low to high."
    )
    if idle is not None and study.day.idle_share is not None and point.idle_w is not None:
        text += (
            f" The computers that are on anyway draw {_range(idle)} Wh besides: "
            f"{point.idle_w['value']:.3g} W of idle is {_percent(study.day.idle_share)} of it all. "
            "Of two ways to estimate the one matters little that saves joules above idle; a board "
            "of less idle power, or one that serves other purposes too, matters."
        )
    ways = {id(it.driven): it for it in reversed(study.points)}
    for it in study.points:
        least = ways[id(it.driven)]
        if it.energy["value"].total_j < least.energy["value"].total_j:
            ways[id(it.driven)] = it
    rows = [_way(study, it) for it in sorted(ways.values(), key=lambda it: it.error_m)]
    head = (
        "Way to operate", f"{study.percent:g} % within", "interval", "estimates a trip",
        "J a trip, above idle", "",
    )  # fmt: skip
    modes = [
        (
            f"{it.mode} {escape(it.mode_name)}",
            _joules_range(economy.trip_j(it)),
            "–" if it.idle_w is None else _idle(it.idle_w),
            "–" if it.idle_w is None else _fleet_day(study, it),
        )
        for it in study.points
        if it.driven is point.driven
    ]
    mode_head = ("Power mode", "a trip, above idle", "idle / W", "Wh a fleet’s day, with idle")
    return section(
        "How to operate it",
        text,
        figure("ways", "Each power mode of each way; dashed: the target.")
        + table(head, rows, numbers=range(1, 5))
        + table(mode_head, modes, numbers=range(1, 4)),
    )


def _way(study: Study, it: Point) -> tuple[str, ...]:
    found = it.driven.percentile(study.percent)
    places = [index for index, other in enumerate(study.points) if other.driven is it.driven]
    label = (
        badge("recommended", "yes")
        if study.recommended in places
        else badge("front", "fit")
        if any(index in study.front for index in places)
        else ""
    )
    return (
        f"{escape(it.method)}, {escape(it.wake_up)}<small>least energy in mode {it.mode} "
        f"({escape(it.mode_name)})</small>",
        f"{found.value:.3f} m",
        f"{escape(found.interval)} m",
        f"{it.driven.executions.mean():,.0f}",
        _joules_range(economy.trip_j(it)),
        label,
    )


def _fleet_day(study: Study, it: Point) -> str:
    day = economy.day(study.plant, it)
    return "–" if day.idle_wh is None else _range(day.trips_wh.plus(day.idle_wh))


def _money(study: Study) -> str:
    if not study.ways:
        return ""
    fleet = json.loads(study.plant.to_json())["fleet"]
    years, currency = fleet["years"], escape(study.prices.currency)
    ways = study.ways.values()
    rows = [
        (f"to buy / {currency}", *(_range(way.capital) for way in ways)),
        (f"a year / {currency}", *(_range(way.yearly) for way in ways)),
        (f"{years:g} years / {currency}", *(_range(economy.total(way, years)) for way in ways)),
        ("production / kgCO2e", *(_range(way.embodied_kg) for way in ways)),
        ("use a year / kgCO2e", *(_range(way.use_kg_per_year) for way in ways)),
        (f"{years:g} years / kgCO2e", *(_range(economy.total_kg(way, years)) for way in ways)),
    ]
    head = (f"{fleet['vehicles']} vehicles by", *study.ways)
    used = [
        "receiver", "lidar", "roadside_unit", "roadside_unit_yearly", "electricity_per_kwh",
        "grid_g_per_kwh", "lidar_power_w", "roadside_unit_power_w", "receiver_embodied_kg",
        "lidar_embodied_kg", "roadside_unit_embodied_kg",
    ]  # fmt: skip
    return section(
        "What does it cost?",
        "Low … central … high, without discounting. The cells are there anyway and are not "
        "counted. The first column counts what localizing adds; with a computer for this alone "
        "its idle power is added. What a LiDAR’s or a roadside unit’s own computing draws is "
        "not counted.",
        table(head, rows, numbers=range(1, 5)) + _sources(study, used),
    )


def _sources(study: Study, keys: list[str]) -> str:
    rows = [
        (
            escape(key.replace("_", " ")),
            _range(study.prices.ranges[key]),
            escape(study.prices.sources[key]),
        )
        for key in dict.fromkeys(keys)
    ]
    return (
        "<details><summary>Where these figures are from</summary>"
        f"{table(('Figure', 'low … central … high', 'Source'), rows, numbers=(1,))}</details>"
    )


def _unstated(study: Study) -> str:
    rows = [
        (
            f"<code>{escape(it.key)}</code>",
            escape(it.what),
            escape(it.otherwise),
            f"{100.0 * (it.effect - 1.0):+.0f} %",
        )
        for it in study.unstated
    ]
    if not rows:
        return section("What nobody has stated", "The plant’s files state everything.", "")
    head = ("Key", "Taken for it", "If it is", "least error")
    return section(
        "What nobody has stated",
        "Values that are not in the plant’s own files, the weightiest first: what the least error "
        "that any localizer can reach (90th percentile along the road) becomes where one is worse.",
        table(head, rows, numbers=(3,)),
    )


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def _range(values: Range) -> str:
    ends = dict.fromkeys(map(_number, (values.low, values.central, values.high)))
    return " … ".join(ends)


def _joules(value: float) -> str:
    return f"{_number(value)} J"


def _joules_range(values: Range) -> str:
    return f"{_range(values)} J"


def _idle(watts: Mapping[str, float]) -> str:
    ends = dict.fromkeys(f"{watts[extent]:.3g}" for extent in ("low", "value", "high"))
    return " … ".join(ends)


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if share > 0.9 else f"{100.0 * share:.0f} %"
