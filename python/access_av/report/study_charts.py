"""Charts of a study: the road coloured by the error, the error along it, ways to operate."""

from __future__ import annotations

import itertools
import json
import math
from typing import TYPE_CHECKING, Any

import altair as alt
import polars as pl

from access_av.report.chart import BLUE, GREEN, GREY, ORANGE, finish, thinned, to_scale
from access_av.study.economy import trip_j
from access_av.study.places import radio_heads

if TYPE_CHECKING:
    from access_av.report.chart import Spec
    from access_av.study.answer import Study

TALLEST_MAP_PX = 640.0
MARGIN_M = 25.0
# Of the target, and the colours of the road within each: cold where it is kept, warm where not.
SHARES = (0.5, 1.0, 1.5)
COLOURS = ("#2f7ed8", "#56b4e9", "#e69f00", "#d55e00")
STRETCHES = 300


def road_map(study: Study) -> Spec:
    """The road coloured by the target's percentile, radio heads, stops and the worst places."""
    heads = pl.DataFrame(
        [
            {
                "name": head["name"] or f"head {number}",
                "x_m": float(head["position_m"][0]),
                "y_m": float(head["position_m"][1]),
            }
            for number, head in enumerate(radio_heads(study.believed.scenario), start=1)
        ]
    )
    places = study.places
    step = max(1, places.height // STRETCHES)
    road = (
        places.with_columns(stretch=pl.int_range(pl.len()) // step)
        .group_by("stretch", maintain_order=True)
        .agg(
            pl.first("along_m", "x_m", "y_m"),
            pl.max("target_error_m"),
        )
        .with_columns(
            x2_m=pl.col("x_m").shift(-1).fill_null(places["x_m"][-1]),
            y2_m=pl.col("y_m").shift(-1).fill_null(places["y_m"][-1]),
            class_=_class(pl.col("target_error_m"), study.error_m),
        )
        .with_columns(pl.col(pl.Float64).round(3))
    )
    every = pl.concat([places.select("x_m", "y_m"), heads.select("x_m", "y_m")])
    ends = every.select(
        *(pl.col(it).min().alias(f"{it}_low") for it in ("x_m", "y_m")),
        *(pl.col(it).max().alias(f"{it}_high") for it in ("x_m", "y_m")),
    ).row(0, named=True)
    *domains, height = to_scale(
        (ends["x_m_low"] - MARGIN_M, ends["x_m_high"] + MARGIN_M),
        (ends["y_m_low"] - MARGIN_M, ends["y_m_high"] + MARGIN_M),
        TALLEST_MAP_PX,
    )
    across, upward = (alt.Scale(domain=it, nice=False) for it in domains)
    names = _classes(study.error_m)
    drawn = (
        alt.Chart(road)
        .mark_rule(strokeWidth=7, strokeCap="round")
        .encode(
            x=alt.X("x_m:Q", title="x / m", scale=across),
            x2="x2_m:Q",
            y=alt.Y("y_m:Q", title="y / m", scale=upward),
            y2="y2_m:Q",
            color=alt.Color(
                "class_:N",
                scale=alt.Scale(domain=names, range=list(COLOURS)),
                legend=alt.Legend(title=None),
            ),
            tooltip=[
                alt.Tooltip("along_m:Q", title="along the road / m", format=".0f"),
                alt.Tooltip("target_error_m:Q", title=f"{study.percent:g} % within / m"),
            ],
        )
    )
    mast = alt.Chart(heads).encode(x=alt.X("x_m:Q", scale=across), y=alt.Y("y_m:Q", scale=upward))
    masts = mast.mark_point(
        shape="triangle-up", filled=True, size=170, color=GREEN, opacity=1.0
    ).encode(tooltip=["name:N"])
    labels = mast.mark_text(dy=-15, fontSize=12, fontWeight="bold").encode(text="name:N")
    layers = drawn + masts + labels
    if walls := _walls(study):
        across_to = {"x": alt.X("x_m:Q", scale=across), "y": alt.Y("y_m:Q", scale=upward)}
        ends = {"x2": "x2_m:Q", "y2": "y2_m:Q"}
        lines = alt.Chart(pl.DataFrame(walls)).mark_rule(strokeWidth=3, color=GREY)
        layers = lines.encode(**across_to, **ends) + layers
    stops = _at(study, [stop["at_m"] for stop in _stops(study)])
    if not stops.is_empty():
        layers += (
            alt.Chart(stops)
            .mark_point(shape="square", size=120, color=GREY, strokeWidth=2)
            .encode(
                x=alt.X("x_m:Q", scale=across),
                y=alt.Y("y_m:Q", scale=upward),
                tooltip=[alt.Tooltip("along_m:Q", title="stop, along the road / m")],
            )
        )
    worst = pl.DataFrame(
        [
            {"number": str(number), "x_m": place.x_m, "y_m": place.y_m}
            for number, place in enumerate(study.worst, start=1)
        ]
    )
    if not worst.is_empty():
        marked = alt.Chart(worst).encode(
            x=alt.X("x_m:Q", scale=across), y=alt.Y("y_m:Q", scale=upward)
        )
        layers += marked.mark_point(
            shape="circle", filled=True, size=330, color="#16202c", stroke="#ffffff", opacity=1.0
        )
        layers += marked.mark_text(fontSize=12, fontWeight="bold", color="#ffffff", dy=1).encode(
            text="number:N"
        )
    return finish(
        layers,
        height=height,
        description="Map of the road, coloured by the error that the target speaks of",
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


def _walls(study: Study) -> list[dict[str, float]]:
    site = json.loads(study.believed.scenario.site.to_json())
    return [
        {"x_m": x_m, "y_m": y_m, "x2_m": x2_m, "y2_m": y2_m}
        for wall in site.get("walls", ())
        for (x_m, y_m), (x2_m, y2_m) in itertools.pairwise(wall["points_m"])
    ]


def _stops(study: Study) -> list[dict[str, float]]:
    stops: list[dict[str, float]] = json.loads(study.plant.to_json())["motion"]["stops"]
    return stops


def _at(study: Study, along_m: list[float]) -> pl.DataFrame:
    rows = [study.places.row(min(study.places.height - 1, int(at)), named=True) for at in along_m]
    columns = ("along_m", "x_m", "y_m")
    return pl.DataFrame([{name: row[name] for name in columns} for row in rows])


def along_road(study: Study) -> Spec:
    """The error along the road, driven and bounded, and the target."""
    names = {
        "target_error_m": f"{study.percent:g} % of errors within",
        "median_error_m": "half of them within",
        "bound_m": "least RMS error of any localizer",
    }
    rows = (
        thinned(study.places.select("along_m", *names))
        .rename(names)
        .unpivot(index="along_m", variable_name="line", value_name="error_m")
    )
    lines = (
        alt.Chart(rows)
        .mark_line(strokeWidth=1.8)
        .encode(
            x=alt.X("along_m:Q", title="along the road / m", scale=alt.Scale(nice=False)),
            y=alt.Y("error_m:Q", title="horizontal error / m"),
            color=alt.Color(
                "line:N",
                scale=alt.Scale(domain=list(names.values()), range=[ORANGE, BLUE, GREEN]),
                legend=alt.Legend(title=None),
            ),
            tooltip=["line:N", "along_m:Q", alt.Tooltip("error_m:Q", format=".3f")],
        )
    )
    target = (
        alt.Chart(pl.DataFrame({"error_m": [study.error_m]}))
        .mark_rule(strokeDash=[5, 4], strokeWidth=1.5)
        .encode(y="error_m:Q")
    )
    return finish(lines + target, height=260, description="Horizontal error along the road")


def signal_along_road(study: Study) -> Spec:
    """Dilution along the road, and the strongest radio head's SNR."""
    rows = thinned(study.places.select("along_m", "dilution_of_degree_m", "best_snr_db"))
    x = alt.X("along_m:Q", title="along the road / m", scale=alt.Scale(nice=False))
    dilution = (
        alt.Chart(rows)
        .mark_line(color=BLUE, strokeWidth=1.8)
        .encode(
            x=x,
            y=alt.Y(
                "dilution_of_degree_m:Q",
                title="dilution / m per degree",
                axis=alt.Axis(titleColor=BLUE),
            ),
        )
    )
    snr = (
        alt.Chart(rows)
        .mark_line(color=ORANGE, strokeWidth=1.8, strokeDash=[6, 3])
        .encode(
            x=x,
            y=alt.Y(
                "best_snr_db:Q",
                title="SNR of the strongest / dB",
                scale=alt.Scale(zero=False),
                axis=alt.Axis(titleColor=ORANGE, orient="right", grid=False),
            ),
        )
    )
    chart = alt.layer(dilution, snr).resolve_scale(y="independent")
    return finish(chart, height=220, description="Dilution and SNR along the road")


def ways_to_operate(study: Study) -> Spec:
    """Energy of a trip against the target's percentile, the front and the recommended point."""
    rows = pl.DataFrame(
        [
            {
                "way": f"{point.method}, {point.wake_up}",
                "mode": f"mode {point.mode} ({point.mode_name})",
                "energy_j": round(trip_j(point).central, 4),
                "error_m": round(point.error_m, 4),
                "kind": "recommended"
                if index == study.recommended
                else "no other is better in both"
                if index in study.front
                else "another is better",
            }
            for index, point in enumerate(study.points)
        ]
    )
    kinds = ["recommended", "no other is better in both", "another is better"]
    chart = (
        alt.Chart(rows)
        .mark_point(filled=True, opacity=0.9)
        .encode(
            x=alt.X(
                "energy_j:Q",
                title="energy of a trip / J",
                scale=alt.Scale(type="log"),
                axis=alt.Axis(values=_round_values(rows["energy_j"])),
            ),
            y=alt.Y("error_m:Q", title=f"{study.percent:g} % of errors within / m"),
            color=alt.Color(
                "kind:N",
                scale=alt.Scale(domain=kinds, range=[ORANGE, BLUE, GREY]),
                legend=alt.Legend(title=None),
            ),
            size=alt.Size(
                "kind:N", scale=alt.Scale(domain=kinds, range=[180, 90, 45]), legend=None
            ),
            tooltip=["way:N", "mode:N", "energy_j:Q", "error_m:Q"],
        )
    )
    target = (
        alt.Chart(pl.DataFrame({"error_m": [study.error_m]}))
        .mark_rule(strokeDash=[5, 4], strokeWidth=1.5)
        .encode(y="error_m:Q")
    )
    return finish(
        chart + target, height=300, description="Energy against error, each way to operate"
    )


def _round_values(values: pl.Series) -> list[float]:
    """1, 2 and 5 times each power of ten about some values: a narrow axis has room for them."""
    low, high = (float(it) for it in (values.min(), values.max()))  # type: ignore[arg-type]
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [round(step * 10.0**power, 9) for power in powers for step in (1.0, 2.0, 5.0)]
