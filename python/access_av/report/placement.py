"""Report of ``access-av design bound``: the bound along the route and over the site."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from access_av.report import drive_charts as charts
from access_av.report.page import VERSION, sheet
from access_av.report.parts import figure, section, shown, source, warnings
from access_av.report.shown import next_level, radio_heads, service_levels
from access_av.run.error_bound import MAP_TRAVEL_M, VISIBLE_SNR_DB, ErrorBound

if TYPE_CHECKING:
    from access_av.radio.upgrades import NextLevel


def render_bound(bound: ErrorBound, missed: NextLevel | None = None) -> str:
    """Returns the bound of one scenario as a self-contained HTML page.

    Parameters
    ----------
    bound
        Result of :func:`access_av.bound`.
    missed
        The next service level, which the site fails.
    """
    summary = bound.summary()
    scenario = bound.scenario
    specs = {
        "route": charts.bound_along_route(bound.route),
        "site": charts.bound_over_site(bound),
    }
    changes = ""
    if missed is not None:
        changes = f"<p>{escape(missed.in_words())}</p>{shown(next_level(missed))}"
    sections = [
        warnings(scenario.warnings()),
        section(
            "Along the route",
            "Posterior Cramér–Rao bound with an angle of every radio head at every SSB: no "
            "localizer with the information of the scenario has a smaller root mean square error.",
            figure("route"),
        ),
        section("Over the site", _map_text(bound), figure("site")),
        section(
            "Radio heads",
            "SNR by the link budget, before shadowing and fading. Visible: share of the route’s "
            f"SSBs with an SNR of {VISIBLE_SNR_DB:g} dB or more, the detection limit of 3GPP (TS "
            "38.133).",
            shown(radio_heads(summary["heads"])),
        ),
        section(
            "Service levels",
            "Levels of TS 22.261, 7.3.2.2, and TR 38.857 for Gaussian errors as small as the "
            "bound. No localizer reaches a level that is not reached here.",
            shown(service_levels(bound.verdicts)) + changes,
        ),
        section("Provenance", "", source("Scenario with all default values", scenario.to_toml())),
    ]
    texts = {"median_m": "median along the route", "p90_m": "90th percentile",
             "max_m": "worst position"}  # fmt: skip
    return sheet(
        specs,
        "bound",
        scenario.name,
        headline=f"RMS error bound: {summary['p90_m']:.2f} m or less on 90 % of the route",
        lead=scenario.description,
        tiles=[
            (f"{summary[key]:.3f} m", f"bound of the RMS error, {text}")
            for key, text in texts.items()
        ],
        meta=f"Scenario “{scenario.name}”, {VERSION}.",
        sections=sections,
    )


def _map_text(bound: ErrorBound) -> str:
    if bound.site["bound_m"].is_null().all():
        return (
            "One radio head does not determine a position without earlier angles. The map shows "
            "only road and radio head."
        )
    return (
        f"Bound of a vehicle after {MAP_TRAVEL_M:g} m of reception "
        f"({bound.map_num_angles:.0f} independent angles of each radio head), with a heading σ of "
        f"{bound.map_heading_std_rad * 1e3:.1f} mrad and an unknown position. Squares of "
        f"{bound.map_step_m:g} m; no square where the radio heads do not determine the position. "
        "To scale on a wide screen."
    )
