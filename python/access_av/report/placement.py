"""The page of ``access-av bound``: the bound along the route and over the site."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING

from access_av.report import drive_charts as charts
from access_av.report.page import sheet
from access_av.report.parts import badge, figure, service_levels, source, table, tile, warnings
from access_av.run.error_bound import MAP_TRAVEL_M, VISIBLE_SNR_DB
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from access_av.radio.upgrades import NextLevel
    from access_av.run.error_bound import ErrorBound

_ENOUGH = {True: ("enough", "yes"), False: ("not enough", "no")}


def render_bound(bound: ErrorBound, missed: NextLevel | None = None) -> str:
    """The bound of one scenario as an HTML page that loads nothing.

    Parameters
    ----------
    bound
        What :func:`access_av.bound` returned.
    missed
        The next service level, which it falls short of.
    """
    summary = bound.summary()
    scenario = bound.scenario
    specs = {
        "route": charts.bound_along_route(bound.route),
        "site": charts.bound_over_site(bound),
    }
    head = ("Radio head", "PCI", "SSB", "x / m", "y / m", "Distance / m", "SNR / dB", "Visible")
    rows = [
        (
            escape(one["name"]),
            str(one["pci"]),
            str(one["ssb_index"]),
            number(one["x_m"], 1),
            number(one["y_m"], 1),
            f"{one['nearest_m']:.0f} to {one['farthest_m']:.0f}",
            "–"
            if one["least_expected_snr_db"] is None
            else f"{one['least_expected_snr_db']:.1f} to {one['most_expected_snr_db']:.1f}",
            f"{one['visible_share']:.1%}",
        )
        for one in summary["heads"]
    ]
    sections = (
        "<section><h2>Along the route</h2><p>Posterior Cramér–Rao bound, an angle to every radio "
        "head being used at every SSB: no localizer that knows what the scenario says has a "
        f"smaller root mean square error.</p>{figure('route')}</section>"
        f"<section><h2>Over the site</h2><p>{_map_text(bound)}</p>{figure('site')}</section>"
        "<section><h2>Radio heads</h2><p>By the link budget, before shadowing and fading. Visible: "
        f"share of the route’s SSBs with an SNR of {VISIBLE_SNR_DB:g} dB or more, down to which "
        f"3GPP wants SSBs detected (TS 38.133).</p>{table(head, rows, numbers=range(1, 8))}"
        "</section><section><h2>Service levels</h2><p>Of TS 22.261, 7.3.2.2, and TR 38.857, with "
        "Gaussian errors as small as the bound allows: what is not reached here no localizer "
        f"reaches.</p>{service_levels(bound.verdicts)}{_missed(missed)}</section>"
        "<section><h2>Provenance</h2>"
        f"{source('Scenario, all defaults written out', scenario.to_toml())}</section>"
    )
    return sheet(
        specs,
        title=f"ACCESS-AV bound: {escape(scenario.name)}",
        kicker="ACCESS-AV bound",
        headline=f"{summary['p90_m']:.2f} m or less on nine tenths of the route, at best",
        lead=escape(scenario.description),
        tiles="".join(
            tile(f"{summary[key]:.3f} m", f"least RMS error, {text}")
            for key, text in (
                ("median_m", "median of the route"),
                ("p90_m", "90th percentile"),
                ("max_m", "worst place"),
            )
        ),
        meta=escape(f"Scenario “{scenario.name}”, version {version('access-av')}."),
        sections=warnings(bound.scenario.warnings()) + sections,
    )


def _missed(level: NextLevel | None) -> str:
    """Where it falls short, and what each change by itself would make of that."""
    if level is None:
        return ""
    rows = [
        (escape(it.what), f"{it.share:.2%}", badge(*_ENOUGH[it.reaches])) for it in level.changes
    ]
    head = (f"Change, for level {escape(level.level.name)}", "within", "")
    return f"<p>{escape(level.in_words())}</p>{table(head, rows, numbers=(1,))}"


def _map_text(bound: ErrorBound) -> str:
    if bound.site["bound_m"].is_null().all():
        return (
            "One radio head alone leaves a direction open: without a past no place of the site has "
            "a position. The road and the radio head are shown."
        )
    return (
        f"Of a vehicle that has listened on {MAP_TRAVEL_M:g} m of way "
        f"({bound.map_angles:.0f} independent angles to each radio head), knows its heading to "
        f"{bound.map_heading_std_rad * 1e3:.1f} mrad and nothing of its place. Squares of "
        f"{bound.map_step_m:g} m; none where the radio heads leave a direction open. "
        "Drawn to scale on a wide screen."
    )
