from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import TYPE_CHECKING

import polars as pl
import pytest
import vl_convert

import synthetic
from access_av.paper import summary
from access_av.report import located_charts
from access_av.report.paper.evaluation import render
from access_av.report.paper.interpretations import interpretations
from access_av.tables.numbers import number, unsigned_zero, value_text
from robot import HEADS_M, robot

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished


@pytest.fixture(scope="module")
def page() -> str:
    return render(synthetic.study())


def test_the_report_loads_nothing_from_the_network(page: str) -> None:
    """No element loads a resource; the remaining URLs are names of schemas and namespaces."""
    markup = re.sub(r"(<script>).*?(</script>)", r"\1\2", page, flags=re.DOTALL)
    assert not re.search(r"<(link|img|iframe|script)[^>]*\b(src|href)=", markup)
    assert not re.search(r"@import|url\(|https?:", markup)
    specs = page.split("const charts = ")[1].split(";\n")[0]
    assert '"url"' not in specs


def test_the_report_contains_every_chart(page: str) -> None:
    places = set(re.findall(r'class="chart" id="([^"]+)"', page))
    assert places >= {
        "overview", "design-x", "design-y", "snr", "energy-bars", "aoa_estimates", "design-space",
        "rsu-cost", "sensor-cost", "ablation", "front",
    }  # fmt: skip
    assert sum(name.startswith("error-") for name in places) == 12
    for name in places:
        assert f'"{name}":{{' in page


def test_the_report_contains_interpretations_claims_settings_and_version(page: str) -> None:
    for text in (
        "a1_adaptive_worst_m", "c2_four_rsu_usd", "seed 1", "2 runs", "version ",
        "Algorithm 1 at every SSB", "by construction", "arithmetic",
        "Not evaluated: broken", "t_max_ms",
    ):  # fmt: skip
        assert text in page


def test_report_size_is_limited(page: str) -> None:
    assert len(page.encode()) < 2_000_000


@pytest.mark.parametrize(
    ("gain", "said"),
    [(0.0, "makes no difference"), (0.5, "helps"), (-0.5, "harms")],
)
def test_the_report_states_an_effect_of_the_controller_only_if_it_is_significant(
    gain: float, said: str
) -> None:
    """The report distinguishes a constant wake-up time from a controller by their results."""
    study = synthetic.study(controller_gain=gain)
    text = interpretations(study)
    assert text.count(f'<td data-label="Algorithm 1">{said}</td>') == 2
    for other in {"makes no difference", "helps", "harms"} - {said}:
        assert other not in text


def test_sentences_depend_on_the_results() -> None:
    study = synthetic.study()
    assert "hold together under none of 2 interpretations" in summary.headline(study)
    met = {claim.id: replace(claim, verdict="reproduced") for claim in study.of("gate")}
    both = replace(study, claims=[*study.of("every-ssb"), *met.values()])
    assert "only if estimates wait" in summary.headline(both)
    assert "which Algorithm 1 does not contain" in summary.lead(both)
    assert "Algorithm 1 makes no difference" in summary.lead(both)
    without = [replace(claim, interpretation="every-ssb") for claim in met.values()]
    assert "under the published Algorithm 1" in summary.headline(
        replace(study, claims=[*without, *study.of("gate")])
    )


def test_an_evaluation_has_a_one_line_representation() -> None:
    evaluation = synthetic.evaluation()
    assert len(repr(evaluation)) < 100
    assert len({evaluation, evaluation}) == 1


def test_zero_is_printed_without_a_sign() -> None:
    assert (number(-0.0001, 2), value_text(-0.0), unsigned_zero("+0.00")) == ("0.00", "0", "0.00")
    assert (number(-0.01, 2), value_text(-1.5), unsigned_zero("+0.01")) == (
        "-0.01",
        "-1.5",
        "+0.01",
    )


def test_values_of_every_shape_can_be_shown() -> None:
    assert value_text({"music": 627.22, "root_music": None}) == "music 627.2, root music none"
    assert value_text([]) == "none"
    assert value_text(52000.0) == "52,000"


def test_the_map_is_drawn_to_scale_and_heads_in_their_order(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    whole = robot(10.0)
    whole.heads_m = {pci - 4: place for pci, place in HEADS_M.items()}
    whole.angles = whole.angles.with_columns(pci=pl.col("pci") - 4)
    assert access_av(*whole.write(tmp_path)).code == 0
    page = (tmp_path / "out" / "report.html").read_text()
    specs = json.loads(page.split("const charts = ")[1].split(";\n")[0])
    track, heads = specs["track"], specs["heads"]
    x, y = (track["layer"][0]["encoding"][axis]["scale"]["domain"] for axis in "xy")
    assert (x[1] - x[0]) / 1000.0 == pytest.approx((y[1] - y[0]) / track["height"], rel=1e-2)
    order = heads["layer"][0]["encoding"]["x"]["sort"]
    assert order == ["7", "8", "9", "10", "11", "12"]


def test_time_axes_start_with_the_data() -> None:
    """With Unix times on its axis, a chart would show the drive as one line."""
    time_s = pl.Series("time_s", [1.7e9, 1.7e9 + 5.0, 1.7e9 + 10.0])
    compared = pl.DataFrame([time_s]).with_columns(deviations=1.0, verdict=pl.lit("accepted"))
    errors = {"error": pl.DataFrame([time_s]).with_columns(error_m=0.1)}
    for spec in (located_charts.angles(compared), located_charts.error(errors)):
        (axis,) = [it for it in vl_convert.vegalite_to_vega(spec)["scales"] if it["name"] == "x"]
        assert axis["zero"] is False
        assert axis["domain"]["field"] == "time_s"
