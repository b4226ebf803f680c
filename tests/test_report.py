from __future__ import annotations

import re

import pytest

import synthetic
from access_av.paper.claims import check_claims
from access_av.paper.report.page import render
from access_av.report.parts import value_text


@pytest.fixture(scope="module")
def page() -> str:
    evaluation = synthetic.evaluation()
    return render(evaluation, check_claims(evaluation))


def test_loads_nothing(page: str) -> None:
    """No element that fetches; links that remain are names of schemas and of namespaces."""
    markup = re.sub(r"(<script>).*?(</script>)", r"\1\2", page, flags=re.DOTALL)
    assert not re.search(r"<(link|img|iframe|script)[^>]*\b(src|href)=", markup)
    assert not re.search(r"@import|url\(|https?:", markup)
    specs = page.split("const charts = ")[1].split(";\n")[0]
    assert '"url"' not in specs


def test_holds_every_chart(page: str) -> None:
    places = set(re.findall(r'class="chart" id="([^"]+)"', page))
    assert {"snr", "energy-bars", "executions", "design-space", "rsu-cost", "sensor-cost"} <= places
    assert sum(name.startswith("error-") for name in places) == 12
    for name in places:
        assert f'"{name}":{{' in page


def test_holds_claims_settings_and_version(page: str) -> None:
    for text in ("a1_adaptive_worst_m", "c2_four_rsu_usd", "seed 1", "2 runs", "version "):
        assert text in page


def test_is_small_enough_to_mail(page: str) -> None:
    assert len(page.encode()) < 2_000_000


def test_values_of_every_shape_can_be_shown() -> None:
    assert value_text({"music": 627.22, "root_music": None}) == "music 627.2, root music none"
    assert value_text([]) == "none"
    assert value_text(52000.0) == "52,000"
