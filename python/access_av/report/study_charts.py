"""Charts of a study: road coloured by the error, error along the road, operating points."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import altair as alt
import polars as pl

from access_av.report.chart import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    Spec,
    colours,
    dashed,
    finish,
    line_chart,
    lines_of,
    thinned,
    tips,
)
from access_av.report.labels import Axis, labelled
from access_av.report.played import played, received_of, steps_of
from access_av.report.site_map import Frame, heads_of
from access_av.report.study_parts import numbered
from access_av.settings import as_dict
from access_av.study.economy import trip_j

if TYPE_CHECKING:
    from access_av.study.study_result import Study

TALLEST_MAP_PX = 640.0
MARGIN_M = 25.0
# Fractions of the target, with the colour of the road: cold if met, warm if not.
SHARES = (0.5, 1.0, 1.5)
COLOURS = ("#2f7ed8", "#56b4e9", "#e69f00", "#d55e00")
STRETCHES = 300
# Height of the chart of operating points (px), with space for labels on narrow screens.
WAYS_PX = 420


def road_map(study: Study) -> Spec:
    """Returns the animated map: road coloured by the target's percentile, radio heads and walls."""
    site = study.nominal.scenario.site
    heads, places = heads_of(site), study.places
    step = max(1, places.height // STRETCHES)
    road = (
        places.with_columns(stretch=pl.int_range(pl.len()) // step)
        .group_by("stretch", maintain_order=True)
        .agg(
            pl.first("along_m", "x_m", "y_m"),
            pl.max("target_error_m", "level_m"),
            pl.min("reliable_share", "best_snr_db"),
        )
        .with_columns(
            x2_m=pl.col("x_m").shift(-1).fill_null(places["x_m"][-1]),
            y2_m=pl.col("y_m").shift(-1).fill_null(places["y_m"][-1]),
            class_=_class(pl.col("target_error_m"), study.error_m),
        )
        .with_columns(pl.col(pl.Float64).round(3))
    )
    frame = Frame.about([places, heads], MARGIN_M, TALLEST_MAP_PX)
    drawn = frame.put(
        alt.Chart(road).mark_rule(strokeWidth=7, strokeCap="round"),
        ends=True,
        color=colours(
            "class_:N", dict(zip(_classes(study.error_m), COLOURS, strict=True)), columns=2
        ),
        tooltip=tips(
            ("along_m:Q", "along the road / m", ".0f"),
            ("target_error_m:Q", f"{study.percent:g} % within / m"),
            ("level_m:Q", "protection level / m"),
            ("reliable_share:Q", "state ok", ".0%"),
            ("best_snr_db:Q", "SNR of the strongest / dB", ".0f"),
        ),
    )
    layers = [*frame.beneath(site), drawn, *frame.masts(heads)]
    targets = _at(study, {it.name: 0.5 * (it.from_m + it.to_m) for it in study.targets.each[1:]})
    stops = _at(
        study,
        {it.get("name") or f"stop at {it['at_m']:.0f} m": it["at_m"] for it in _stops(study)},
    )
    named = {stop["name"] for stop in _stops(study) if stop.get("name")}
    named |= {name for name, *_ in study.plant.targets if name}
    for rows, shape, colour in ((stops, "square", GREY), (targets, "diamond", PURPLE)):
        if rows.is_empty():
            continue
        symbol = alt.Chart(rows).mark_point(shape=shape, size=120, color=colour, strokeWidth=2)
        said = tips(("name:N",), ("along_m:Q", "along the road / m"))
        layers.append(frame.put(symbol, tooltip=said))
        shown = rows.filter(pl.col("name").is_in(list(named)))
        if rows is targets and not stops.is_empty():  # one name for a stop and its target
            shown = shown.join(stops, on=["name", "x_m", "y_m"], how="anti")
        if not shown.is_empty():
            text = alt.Chart(shown).mark_text(fontSize=11, dy=16 if rows is stops else -14)
            layers.append(frame.put(text, text="name:N"))
    worst = pl.DataFrame(
        [
            {"number": str(number), "x_m": place.x_m, "y_m": place.y_m}
            for number, place in enumerate(study.worst, start=1)
        ]
    )
    if not worst.is_empty():
        disc = alt.Chart(worst).mark_point(
            shape="circle", filled=True, size=330, color="#16202c", stroke="#ffffff", opacity=1.0
        )
        number = alt.Chart(worst).mark_text(fontSize=12, fontWeight="bold", color="#ffffff", dy=1)
        layers += [frame.put(disc), frame.put(number, text="number:N")]
    steps, received = steps_of(study.example_run), received_of(study.example_run)
    return finish(
        played(frame, alt.LayerChart(layer=layers), steps, received, heads),
        height=frame.height_px,
        description="Map of the road, coloured by the percentile of the error in the target",
    )


def _class(error_m: pl.Expr, target_m: float) -> pl.Expr:
    names = _classes(target_m)
    found: Any = pl.when(error_m <= SHARES[0] * target_m).then(pl.lit(names[0]))
    for share, name in zip(SHARES[1:], names[1:-1], strict=True):
        found = found.when(error_m <= share * target_m).then(pl.lit(name))
    last: pl.Expr = found.otherwise(pl.lit(names[-1]))
    return last


def _classes(target_m: float) -> list[str]:
    ends = [f"{share * target_m:.2g}" for share in SHARES]
    return [
        f"up to {ends[0]} m",
        f"to {ends[1]} m, the target",
        f"to {ends[2]} m",
        f"above {ends[2]} m",
    ]


def _stops(study: Study) -> list[dict[str, Any]]:
    stops: list[dict[str, Any]] = as_dict(study.plant)["motion"]["stops"]
    return stops


def _at(study: Study, along_m: dict[str, float]) -> pl.DataFrame:
    """Returns named positions on the road, from their distances along the road."""
    last = study.places.height - 1
    rows = [
        (name, study.places.row(min(last, int(at)), named=True)) for name, at in along_m.items()
    ]
    columns = ("along_m", "x_m", "y_m")
    return pl.DataFrame(
        [{"name": label, **{name: row[name] for name in columns}} for label, row in rows]
    )


def along_road(study: Study) -> Spec:
    """Returns the chart of error, protection level, bound and target along the road."""
    names = {
        "target_error_m": f"{study.percent:g}th percentile of the error",
        "median_error_m": "median error",
        "level_m": "median protection level",
        "bound_m": "minimum RMS error",
    }
    lines = line_chart(
        lines_of(study.places, "along_m", names, "error_m"),
        dict(zip(names.values(), (ORANGE, BLUE, PURPLE, GREEN), strict=True)),
        alt.X("along_m:Q", title="along the road / m", scale=alt.Scale(nice=False)),
        alt.Y("error_m:Q", title="horizontal error / m"),
        [*tips(("line:N",), ("along_m:Q",)), alt.Tooltip("error_m:Q", format=".3f")],
        columns=2,
    )
    target = dashed("y", "error_m", study.error_m)
    chart: Any = lines + target
    return finish(chart, height=260, description="Horizontal error along the road")


def signal_along_road(study: Study) -> Spec:
    """Returns the chart of dilution, and of the SNR of the strongest radio head, along the road."""
    rows = thinned(study.places.select("along_m", "along_road_error_per_degree_m", "best_snr_db"))
    x = alt.X("along_m:Q", title="along the road / m", scale=alt.Scale(nice=False))

    def line(column: str, title: str, colour: str, scale: Any, dash: Any, **axis: Any) -> Any:
        marks = alt.Chart(rows).mark_line(color=colour, strokeWidth=1.8, strokeDash=dash)
        y_axis = alt.Axis(titleColor=colour, **axis)
        return marks.encode(x=x, y=alt.Y(f"{column}:Q", title=title, scale=scale, axis=y_axis))

    dilution_axis = ("along_road_error_per_degree_m", "dilution / m per degree")
    dilution = line(*dilution_axis, BLUE, alt.Undefined, alt.Undefined)
    snr_axis = ("best_snr_db", "SNR of the strongest / dB")
    snr = line(*snr_axis, ORANGE, alt.Scale(zero=False), [6, 3], orient="right", grid=False)
    chart = alt.layer(dilution, snr).resolve_scale(y="independent")
    return finish(chart, height=220, description="Dilution and SNR along the road")


def ways_to_operate(study: Study) -> Spec:
    """Returns the chart of energy against the target's percentile, with front and recommendation.

    The numbers are those of :func:`access_av.report.study_parts.numbered`.
    """
    kinds = ["recommended", "Pareto front of the candidates", "other points"]
    rows = pl.DataFrame(
        [
            {
                "number": number,
                "way": f"{point.operation.method}, {point.operation.wake_up}",
                "mode": f"mode {point.mode} ({point.mode_name})",
                "energy_j": round(trip_j(point).central, 4),
                "error_m": round(point.error_m, 4),
                "kind": kinds[0]
                if index == study.recommended
                else kinds[1]
                if index in study.front
                else kinds[2],
            }
            for number, (index, point) in enumerate(numbered(study), start=1)
        ]
    ).filter(pl.col("error_m").is_finite())
    base, lines, numbers = labelled(
        rows,
        "number",
        Axis(
            "energy_j",
            "energy of a trip / J",
            rows["energy_j"].to_list(),
            log=True,
            axis=alt.Axis(values=_round_values(rows["energy_j"])),
        ),
        Axis(
            "error_m",
            f"{study.percent:g}th percentile of the error / m",
            [*rows["error_m"], study.error_m],
        ),
        WAYS_PX,
        tooltip=["number:N", "way:N", "mode:N", "energy_j:Q", "error_m:Q"],
    )
    points = base.mark_point(filled=True, opacity=0.9).encode(
        color=colours("kind:N", dict(zip(kinds, (ORANGE, BLUE, GREY), strict=True)), columns=1),
        size=alt.Size("kind:N", scale=alt.Scale(domain=kinds, range=[110, 70, 40]), legend=None),
    )
    target = dashed("y", "error_m", study.error_m)
    # Draw the points of the front over the others, and the recommended one last.
    drawn = [points.transform_filter(alt.datum.kind == kind) for kind in reversed(kinds)]
    chart: Any = alt.layer(target, lines, *drawn, numbers)
    return finish(
        chart,
        height=WAYS_PX,
        description="Energy against error of each operating point",
    )


def _round_values(values: pl.Series) -> list[float]:
    """Returns 1, 2 and 5 times powers of ten in a range, as ticks of a narrow axis."""
    low, high = (float(it) for it in (values.min(), values.max()))  # type: ignore[arg-type]
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [round(step * 10.0**power, 9) for power in powers for step in (1.0, 2.0, 5.0)]
