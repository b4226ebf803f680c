"""Sections of a study's report on the operating point and the costs."""

from __future__ import annotations

import math

from access_av.report.parts import badge, code, figure, folded, records, section, small
from access_av.report.study_parts import (
    digits,
    ends,
    in_points,
    joules_range,
    lost,
    low_to_high,
    numbered,
    ok,
    sources,
)
from access_av.run.assumptions import energy_boundary
from access_av.settings import as_dict
from access_av.study import economy
from access_av.study.points import MATTERS_SHARE, OK_MARGIN, Point
from access_av.study.study_result import Study, as_toml, rule
from access_av.tables.numbers import count

# Condition of the badge "equivalent" of a rival.
EQUIVALENT = (
    "Equivalent points have no disadvantage that matters. Accuracy: the point meets the targets "
    "with an equal or better verdict, or the 95 % interval of the error difference contains 0 or "
    f"smaller errors. State ok: the share of time is lower by at most {100.0 * OK_MARGIN:g} "
    "percentage point, or the interval of the difference contains 0 or higher shares. Energy of "
    f"the fleet’s day, idle included: it is higher by less than {MATTERS_SHARE:.0%}. The intervals "
    "of all operations hold together with 95 % confidence (Bonferroni)."
)


def operation_section(study: Study) -> str:
    """Returns the section on the recommended operating point, its rivals, and its energy."""
    point, day = study.point, study.day
    if point is None or day is None:
        return section("How to operate it", "The vehicle’s platform contains no energy.", "")
    boundary = energy_boundary(point.driven.scenario) or "unstated"
    found = point.driven.percentile(study.percent)
    text = (
        f"Recommended: {point.name}. {study.percent:g} % of the errors are within "
        f"{found.value:.3f} m ({found.interval} m, {point.driven.runs} drives); a "
        f"trip takes {joules_range(economy.trip_j(point))}, the fleet’s day "
        f"{ends(day.trips_wh)} Wh (low … central … high; energy {boundary}).{_availability(point)} "
        f"{' '.join(rule(study.recommendation))} {_equivalent(study)}"
    )
    keys = [
        {"Key": code(key), "Value": code(as_toml(value))} for key, value in point.settings.items()
    ]
    return section(
        "How to operate it",
        text,
        "<p>recommended.toml next to this page contains this operating point: "
        "<code>access-av run recommended.toml</code> simulates it. Its keys:</p>"
        + records(keys)
        + _rivals(study)
        + _composition(study, point, day)
        + figure(
            "ways",
            "Each power mode of each operation; dashed: the target. The numbers are those of the "
            "table of all points.",
        )
        + _numbered(study)
        + _points(study, point),
    )


def _availability(point: Point) -> str:
    """Returns the share of the time in state ``ok``, compared with the vehicle's own operation."""
    if point.driven.ok_share is None or point.ok_delta is None:
        return ""
    return (
        f" State ok: {point.driven.ok_share:.1%} of the time; recommended point minus the "
        f"vehicle’s own operation in pairs of drives: {in_points(point.ok_delta)}."
    )


def _equivalent(study: Study) -> str:
    """Returns the number of operations that are equivalent to the recommended one, as text."""
    chosen = study.point
    rivals = [
        it
        for it in study.recommendation.rivals
        if chosen is not None and it.point.operation != chosen.operation
    ]
    same = sum(it.is_equivalent for it in rivals)
    return (
        f"{same} of {count(len(rivals), 'other operation')} are equivalent to the recommended "
        "point; --runs adds drives, which distinguish more of them."
    )


def _rivals(study: Study) -> str:
    rows = []
    for it in study.recommendation.rivals:
        delta, low, high = it.delta_m
        judged = it.point.judgement
        rows.append(
            {
                "Rival": it.point.name,
                "Lost drives": lost(it.point.driven),
                f"{study.percent:g} % within": f"{it.point.error_m:.3f} m",
                "error difference": small(f"{delta:+.3f} m", f"{low:+.3f} to {high:+.3f} m"),
                "energy difference, a trip": f"{it.delta_j:+.3g} J",
                "of the fleet’s day": f"{100.0 * it.day_share:+.2g} %",
                "state ok": ok(it.point.driven)
                if it.ok_delta is None
                else small(ok(it.point.driven), in_points(it.ok_delta)),
                "": badge("equivalent", "fit")
                if it.is_equivalent
                else badge(judged.words, judged.badge),
            }
        )
    if not rows:
        return ""
    return (
        "<h3>Rivals of the recommended point</h3><p>Differences: rival − recommended, in pairs of "
        f"drives. {EQUIVALENT}</p>" + records(rows, numbers=range(2, 7))
    )


def _composition(study: Study, point: Point, day: economy.Day) -> str:
    fleet = as_dict(study.plant)["fleet"]
    parts = economy.composition(point, day, fleet)
    whole, added = sum(parts.values()), parts["estimates"] + parts["receiver"]
    named = {
        "estimates": "angle estimates",
        "receiver": "receiver",
        "idle": "computers, idle while switched on",
    }
    rows = [
        {
            "Part": named[name],
            "Fleet’s day": f"{digits(wh)} Wh",
            "share above idle": "–"
            if name == "idle" or not added
            else f"{100.0 * wh / added:.4g} %",
            "share of all": f"{100.0 * wh / whole:.4g} %" if whole else "–",
        }
        for name, wh in parts.items()
    ]
    text = ""
    if day.idle_share is not None:
        text = (
            f"<p>Idle computers take {100.0 * day.idle_share:.4g} % of the fleet’s day. A computer "
            "with less idle power, or one that also serves other purposes, reduces this energy. "
            "Estimator "
            "and wake-up have little effect on it.</p>"
        )
    return f"<h3>Composition of the energy</h3>{text}" + records(rows, numbers=range(1, 4))


def _numbered(study: Study) -> str:
    """Returns the table of all points of the chart, by energy."""
    rows = [
        {
            "No.": str(number),
            "Operation": f"{it.operation.method}, {it.operation.wake_up}",
            "Power mode": f"{it.mode} ({it.mode_name})",
            "energy of a trip": f"{economy.trip_j(it).central:.3g} J",
            f"{study.percent:g} % within": f"{it.error_m:.3f} m"
            if math.isfinite(it.error_m)
            else "lost",
        }
        for number, (_, it) in enumerate(numbered(study), start=1)
    ]
    return folded(f"All {len(rows)} points of the chart", records(rows, numbers=range(3, 5)))


def _points(study: Study, point: Point) -> str:
    """Returns the table of operations in the best mode, then in all power modes."""
    least: dict[str, Point] = {}
    for it in study.points:
        if it.operation.name not in least or it.energy_j < least[it.operation.name].energy_j:
            least[it.operation.name] = it
    least[point.operation.name] = point
    rows = [_way(study, it) for it in sorted(least.values(), key=lambda it: it.error_m)]
    modes = [
        {
            "Power mode": f"{it.mode} {it.mode_name}",
            f"{study.percent:g} % within": f"{it.error_m:.3f} m",
            "a trip, above idle": joules_range(economy.trip_j(it)),
            "idle / W": "–"
            if it.idle_w is None
            else low_to_high(f"{power_w:.3g}" for power_w in it.idle_w.ends),
            "Wh a fleet’s day, with idle": "–"
            if (idle_wh := (day := economy.day(study.plant, it)).idle_wh) is None
            else ends(day.trips_wh.plus(idle_wh)),
        }
        for it in study.points
        if it.operation.name == point.operation.name
    ]
    return (
        records(rows, numbers=range(2, 7))
        + "<h3>Recommended operation in every power mode</h3>"
        + records(modes, numbers=range(1, 5))
    )


def _way(study: Study, it: Point) -> dict[str, str]:
    found = it.driven.percentile(study.percent)
    if it is study.point:
        label = badge("recommended", "yes")
    elif it.judgement.holds and not it.is_available:
        label = badge("less often ok", "no")
    else:
        label = badge(it.judgement.words, it.judgement.badge)
    return {
        "Operation": small(
            f"{it.operation.method}, {it.operation.wake_up}",
            f"mode {it.mode} ({it.mode_name}); {it.driven.runs} drives",
        ),
        "Lost drives": lost(it.driven),
        f"{study.percent:g} % within": f"{found.value:.3f} m",
        "interval": f"{found.interval} m",
        "estimates a trip": f"{it.driven.aoa_estimates.mean():,.0f}",
        "J a trip, above idle": joules_range(economy.trip_j(it)),
        "state ok": ok(it.driven),
        "": label,
    }


def money_section(study: Study) -> str:
    """Returns the section on money and carbon; empty without a recommendation."""
    if not study.ways:
        return ""
    fleet = as_dict(study.plant)["fleet"]
    years, currency = fleet["years"], study.prices.currency
    vehicles = f"{fleet['vehicles']} vehicles by"
    money = [
        {
            vehicles: name,
            f"to buy / {currency}": ends(way.capital),
            f"a year / {currency}": ends(way.yearly),
            f"{years:g} years / {currency}": ends(economy.total(way, years)),
        }
        for name, way in study.ways.items()
    ]
    carbon = [
        {
            vehicles: name,
            "production / kgCO2e": ends(way.embodied_kg),
            "use a year / kgCO2e": ends(way.use_kg_per_year),
            f"{years:g} years / kgCO2e": ends(economy.total_kg(way, years)),
        }
        for name, way in study.ways.items()
    ]
    used = [
        "receiver", "computer", "lidar", "roadside_unit", "roadside_unit_yearly", "uwb_anchor",
        "uwb_anchor_spacing_m", "uwb_tag", "electricity_per_kwh", "grid_g_per_kwh",
        "lidar_power_w", "roadside_unit_power_w", "uwb_anchor_power_w", "uwb_tag_power_w",
        "receiver_embodied_kg", "computer_embodied_kg", "lidar_embodied_kg",
        "roadside_unit_embodied_kg", "uwb_anchor_embodied_kg", "uwb_tag_embodied_kg",
    ]  # fmt: skip
    published = sum(key in study.prices.published for key in used)
    return section(
        "What does it cost?",
        f"Low … central … high, in {study.prices.currency}, without discounting. Vehicles and "
        f"infrastructure are on {fleet['hours_per_day']:g} h on {fleet['days_per_year']:g} days a "
        "year. The cells of the network exist already and are not counted; a computer counts "
        f"with its price, production and idle power. {published} of {len(used)} figures "
        "are published ones and unverified for this plant.",
        records(money, numbers=range(1, 4))
        + records(carbon, numbers=range(1, 4))
        + sources(study, used),
    )
