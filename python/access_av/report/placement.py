"""Report of ``access-av design bound``: the bound along the route and over the site."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING

from access_av.report import drive_charts as charts
from access_av.report.page import sheet
from access_av.report.parts import figure, shown, source, tile, warnings
from access_av.report.shown import next_level, radio_heads, service_levels
from access_av.run.error_bound import MAP_TRAVEL_M, VISIBLE_SNR_DB

if TYPE_CHECKING:
    from access_av.radio.upgrades import NextLevel
    from access_av.run.error_bound import ErrorBound


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
    sections = (
        "<section><h2>Along the route</h2><p>Posterior Cramér–Rao bound with an angle of every "
        "radio head at every SSB: no localizer with the information of the scenario has a "
        f"smaller root mean square error.</p>{figure('route')}</section>"
        f"<section><h2>Over the site</h2><p>{_map_text(bound)}</p>{figure('site')}</section>"
        "<section><h2>Radio heads</h2><p>By the link budget, before shadowing and fading. Visible: "
        f"share of the route’s SSBs with an SNR of {VISIBLE_SNR_DB:g} dB or more, the detection "
        f"limit of 3GPP (TS 38.133).</p>{shown(radio_heads(summary['heads']))}"
        "</section><section><h2>Service levels</h2><p>Levels of TS 22.261, 7.3.2.2, and TR 38.857 "
        "for Gaussian errors as small as the bound. No localizer reaches a level that is not "
        f"reached here.</p>{shown(service_levels(bound.verdicts))}{_missed(missed)}</section>"
        "<section><h2>Provenance</h2>"
        f"{source('Scenario with all default values', scenario.to_toml())}</section>"
    )
    return sheet(
        specs,
        title=f"ACCESS-AV bound: {escape(scenario.name)}",
        kicker="ACCESS-AV bound",
        headline=f"RMS error bound: {summary['p90_m']:.2f} m or less on 90 % of the route",
        lead=escape(scenario.description),
        tiles="".join(
            tile(f"{summary[key]:.3f} m", f"bound of the RMS error, {text}")
            for key, text in (
                ("median_m", "median along the route"),
                ("p90_m", "90th percentile"),
                ("max_m", "worst position"),
            )
        ),
        meta=escape(f"Scenario “{scenario.name}”, version {version('access-av')}."),
        sections=warnings(bound.scenario.warnings()) + sections,
    )


def _missed(level: NextLevel | None) -> str:
    """Returns the shortfall, and the effect of each single change."""
    if level is None:
        return ""
    return f"<p>{escape(level.in_words())}</p>{shown(next_level(level))}"


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
