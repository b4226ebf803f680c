"""Report of ``access-av design sweep``: table, energy against error, error over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import altair as alt
import numpy as np
import polars as pl

from access_av.report.chart import GREEN, GREY, ORANGE, Spec, finish, thinned, tips
from access_av.report.labels import Axis, placed
from access_av.report.labels import layers as labels
from access_av.report.page import VERSION, sheet
from access_av.report.parts import badge, figure, records, section, source, warnings
from access_av.statistics.percentiles import ends_text
from access_av.tables.numbers import number, value_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av._core import Scenario
    from access_av.designs.driven import Driven

# Maximum number of designs in the chart, in the chart over time, and in the table, ordered by front
# and energy.
MOST_DESIGNS, MOST_TRACKS, POINTS_PER_TRACK, MOST_ROWS = 4000, 40, 60, 100
# Maximum number of labelled points: the Pareto front first, then the least energy.
MOST_NAMES = 30
ENERGY_ERROR_PX = 320

COMPARED = (
    "All designs use equal runs. The Pareto front contains the designs for which no other design "
    "has less energy and a smaller RMS error, with 95 % confidence. "
)
IN_WORST = (
    "Each design was simulated in {count} environments ({names}). The table shows its worst "
    "environment. "
)


def render_designs(
    scenario: Scenario, driven: Sequence[Driven], rows: pl.DataFrame, of_worlds: pl.DataFrame
) -> str:
    """Returns the designs of a scenario as a self-contained HTML page.

    Parameters
    ----------
    scenario
        Simulated scenario.
    driven
        Designs.
    rows, of_worlds
        Results of :func:`~access_av.designs.front.rows_of` and
        :func:`~access_av.designs.front.rows_of_worlds`.
    """
    ordered = rows.sort("on_front", "energy_j", descending=[True, False], nulls_last=True)
    known = ordered.drop_nulls(["energy_j", "rms_error_m"])
    runs = int(rows["runs"].max())  # type: ignore[arg-type]
    text = COMPARED
    if not of_worlds.is_empty():
        names = of_worlds["world"].unique(maintain_order=True).to_list()
        text += IN_WORST.format(count=len(names), names="; ".join(names))
    specs: dict[str, Spec] = {}
    sections = [section("Designs", text, _table(ordered))]
    if known.is_empty():
        sections.append(section("Energy against error", "No design has a known energy.", ""))
    else:
        specs["designs"] = _energy_against_error(known.head(MOST_DESIGNS))
        caption = (
            "99th percentile of the horizontal error. Orange: Pareto front, with the 95 % interval "
            "of the bootstrap over whole runs. The numbers are those of the table."
        )
        if known.height > MOST_NAMES:
            caption += f" {MOST_NAMES} of {known.height} designs are numbered, the front first."
        sections.append(section("Energy against error", caption, figure("designs")))
        specs["tracks"] = _over_time(driven, known)
        caption = "RMS error of one design over its runs. Select the design below the chart."
        sections.append(section("Over the drive", caption, figure("tracks")))
    if not of_worlds.is_empty():
        sections.append(section("Each environment", "", _table(of_worlds, of_worlds=True)))
    front = int(rows["on_front"].sum())
    written = source("Scenario with all default values", scenario.to_toml())
    return sheet(
        specs,
        "designs",
        scenario.name,
        headline=f"{front} of {rows.height} designs on the Pareto front of energy and error",
        lead=scenario.description,
        tiles=_tiles(rows, runs),
        meta=f"Scenario “{scenario.name}”, {VERSION}.",
        sections=[warnings(scenario.warnings()), *sections, section("Provenance", "", written)],
    )


def _tiles(rows: pl.DataFrame, runs: int) -> list[tuple[str, str]]:
    tiles = [(str(rows.height), f"designs, {runs} runs each")]
    if (energy_j := rows["energy_j"].min()) is not None:
        tiles.append((f"{value_text(energy_j)} J", "minimum energy of a trip"))
    if (error_m := rows["p99_error_m"].min()) is not None:
        tiles.append((f"{value_text(error_m)} m", "minimum 99th percentile of the error"))
    return tiles


def _table(rows: pl.DataFrame, *, of_worlds: bool = False) -> str:
    """Returns the table of the first :data:`MOST_ROWS` designs."""
    world = {"world": "Environment" if of_worlds else "Worst environment"}
    if not (rows["world"] != "").any():
        world = {}
    cells = [
        {
            "No.": str(row["design"]),
            "Design": row["choice"] or "baseline",
            **{name: row[key] for key, name in world.items()},
            "Energy / J": number(row["energy_j"], 2),
            "Median / m": number(row["p50_error_m"]),
            "p90 / m": number(row["p90_error_m"]),
            "p99 / m": number(row["p99_error_m"]),
            "95 % interval of p99": ends_text(row["p99_error_low_m"], row["p99_error_high_m"]),
            "RMS / m": number(row["rms_error_m"]),
            "Estimates": number(row["aoa_estimates"], 0),
            **(
                {}
                if of_worlds
                else {"Pareto front": badge("yes", "yes") if row["on_front"] else ""}
            ),
        }
        for row in rows.head(MOST_ROWS).iter_rows(named=True)
    ]
    first = 2 + len(world)
    made = records(cells, numbers=range(first, first + 7))
    more = rows.height - MOST_ROWS
    below = f'<p class="note">{more} more designs are in the Parquet file of this report.</p>'
    return made + (below if more > 0 else "")


def _energy_against_error(drawn: pl.DataFrame) -> Spec:
    """Returns the chart of energy against the 99th percentile of the error."""
    columns = ("design", "choice", "energy_j", "p99_error_m", "rms_error_m", "aoa_estimates")
    ends = ("p99_error_low_m", "p99_error_high_m")
    points = drawn.select(
        *columns,
        *ends,
        "on_front",
        # Skip designs without a percentile.
    ).drop_nulls("p99_error_m")
    front = points.filter("on_front")
    others, known = points.filter(~pl.col("on_front")), front.drop_nulls(list(ends))
    reached = [points["p99_error_m"], *(known[end] for end in ends)]
    x_axis = Axis("energy_j", "energy of a trip / J", points["energy_j"].to_list(), log=True)
    y_axis = Axis(
        "p99_error_m", "99th percentile of the error / m", [it for one in reached for it in one]
    )
    x, y = x_axis.of(alt.X), y_axis.of(alt.Y)
    tooltip = tips(
        ("design:Q", "No."),
        ("choice:N", "design"),
        ("energy_j:Q", "energy / J", ".3g"),
        ("p99_error_m:Q", "99th percentile / m", ".3g"),
        ("rms_error_m:Q", "RMS / m", ".3g"),
        ("aoa_estimates:Q", "estimates", ".0f"),
    )

    def layer(rows: pl.DataFrame, colour: str, opacity: float) -> Any:
        marks = alt.Chart(rows).mark_circle(size=70, color=colour, opacity=opacity)
        return marks.encode(x=x, y=y, tooltip=tooltip)

    # Omit an empty layer, which causes a warning of Vega in the console.
    layers = [] if others.is_empty() else [layer(others, GREY, 0.5)]
    if not known.is_empty():
        rules = alt.Chart(known).mark_rule(color=ORANGE, opacity=0.6)
        layers.append(rules.encode(x=x, y="p99_error_low_m:Q", y2="p99_error_high_m:Q"))
    if not front.is_empty():
        layers.append(layer(front, ORANGE, 1.0))
    number = pl.when(pl.int_range(pl.len()) < MOST_NAMES).then("design")
    numbered = placed(points.with_columns(number=number), "number", x_axis, y_axis, ENERGY_ERROR_PX)
    labelled = numbered.filter(pl.col("label") != "")
    layers += labels(alt.Chart(labelled).encode(x=x, y=y))
    chart: Any = alt.layer(*layers)
    return finish(
        chart,
        height=ENERGY_ERROR_PX,
        description="Energy of a trip against the error of each design",
    )


def _over_time(driven: Sequence[Driven], known: pl.DataFrame) -> Spec:
    """Returns the chart of the selected design's RMS error over the drive."""
    nearest = known.head(MOST_TRACKS)
    names = [
        f"{design}: {choice or 'unchanged'}"
        for design, choice in nearest.select("design", "choice").iter_rows()
    ]
    tracks = pl.concat(
        thinned(
            pl.DataFrame(
                {
                    "name": name,
                    "time_s": driven[index].track_s,
                    "rms_error_m": np.sqrt(driven[index].track_m2),
                }
            ),
            POINTS_PER_TRACK,
        )
        for index, name in zip(nearest["design"], names, strict=True)
    )
    select = alt.binding_select(options=names, name="Design ")
    chosen = alt.param(name="chosen", value=names[0], bind=select)
    track = (
        alt.Chart(tracks)
        .mark_line(color=GREEN)
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("rms_error_m:Q", title="RMS error / m"),
        )
        .add_params(chosen)
        .transform_filter("datum.name == chosen")
    )
    return finish(track, height=200, description="RMS error of a design over the drive")
