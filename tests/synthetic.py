"""Synthetic evaluation with smooth error curves, for tests of the evaluation without simulation."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import polars as pl

from access_av.device.platform import Figure, PowerMode
from access_av.paper import ablation, own_design
from access_av.paper.claims import check_claims
from access_av.paper.evaluation import Evaluation, _point, cases, outcome_of
from access_av.paper.interpretations import load
from access_av.paper.outcome import Drives
from access_av.paper.study import Study

ROWS = [
    (0, 2265.6, 80, 65, 70),
    (1, 1200.0, 150, 130, 135),
    (2, 1200.0, 150, 130, 135),
    (3, 1200.0, 150, 130, 135),
    (4, 1450.0, 120, 110, 110),
    (5, 1780.0, 100, 90, 95),
    (6, 2100.0, 100, 70, 75),
    (7, 2188.0, 100, 70, 75),
]
METHODS = ("music", "esprit", "root_music")
ADAPTIVE_EXECUTIONS = {80: 430, 100: 388, 120: 354, 150: 302}
WORST_Y_M = {"music": 0.65, "esprit": 1.2, "root_music": 0.7}
MUSIC_J = (0.61, 0.9, 0.83, 0.83, 0.76, 0.69, 0.65, 0.532)
TRIP_S = 80.34
TIME_S = np.arange(0.0, TRIP_S, 0.02)


def platform() -> SimpleNamespace:
    modes = [
        PowerMode(
            number=number,
            name=f"MODE_{number}",
            cpu_hz=mhz * 1e6,
            base_wake_up_ms=dict(zip(METHODS, map(float, times), strict=True)),
            energy_per_execution_j={
                method: Figure(MUSIC_J[number] * factor, "assumed", "a test", "marginal")
                for method, factor in zip(METHODS, (1.0, 0.85, 0.9), strict=True)
            },
        )
        for number, mhz, *times in ROWS
    ]
    return SimpleNamespace(
        name="synthetic",
        modes=modes,
        energy_boundary="marginal",
        to_toml=lambda: 'name = "synthetic"\n',
        core=None,
    )


def drives(worst_y_m: float, aoa_estimates: float, *, spread: float = 0.0) -> Drives:
    """Runs whose error increases until the end; variants scatter around the first one."""
    factors = 1.0 + spread * np.concatenate([[0.0], np.linspace(-2.0, 2.0, 20)])
    curve = worst_y_m * (TIME_S[::5] / TIME_S[-1]) ** 1.5
    return Drives(
        aoa_estimates=np.full(21, float(aoa_estimates)),
        worst_x_m=worst_y_m / 10 * factors,
        worst_y_m=worst_y_m * factors,
        rms_error_m=worst_y_m * 0.6 * factors,
        horizontal_m=np.outer(factors, curve),
        longest_gap_s=0.24,
    )


def evaluation(
    *, adaptive_worst_m: float = 0.2, spread: float = 0.0, trip_s: float = TRIP_S
) -> Evaluation:
    board = platform()
    found, errors = [], {}
    for case in cases(board):
        setting = case.setting
        worst_m = adaptive_worst_m if setting.adaptive else WORST_Y_M[setting.method]
        if setting.adaptive:
            aoa_estimates = ADAPTIVE_EXECUTIONS[int(setting.base_wake_up_ms)]
        else:
            aoa_estimates = int(80_330 / setting.base_wake_up_ms) + 1
        found.append((case, drives(worst_m, aoa_estimates, spread=spread)))
        error_m = worst_m * (TIME_S / TIME_S[-1]) ** 1.5
        errors[setting] = pl.DataFrame(
            {"time_s": TIME_S, "mean_abs_error_x_m": error_m / 10, "mean_abs_error_y_m": error_m}
        ).select(
            pl.lit(setting.method).alias("method"),
            pl.lit(setting.adaptive).alias("adaptive"),
            pl.lit(setting.base_wake_up_ms).alias("base_wake_up_ms"),
            pl.all(),
        )
    outcome, refitted = outcome_of(found, board, trip_s)
    return Evaluation(
        interpretation=load("gate"),
        points=pl.DataFrame(
            [_point(case, outcome, refitted) for case, _ in found], infer_schema_length=None
        ),
        errors=pl.concat(errors.values()),
        snr=pl.DataFrame({"time_s": TIME_S, "mean_true_snr_db": 1 + 9 * np.sin(TIME_S / 35) ** 2}),
        outcome=outcome,
        platform=board,
        runs=2,
        seed=1,
        refitted=refitted,
    )


def study(*, controller_gain: float = 0.0) -> Study:
    """Returns a study of two interpretations whose controllers reduce the RMS error by given
    amounts."""
    shown = evaluation(spread=0.01)
    other = replace(shown, interpretation=load("every-ssb"))
    constant = drives(0.2 * (1.0 + controller_gain), 430, spread=0.02)
    return Study(
        evaluations=[other, shown],
        claims=[
            claim
            for each in (other, shown)
            for claim in check_claims(each.outcome, interpretation=each.interpretation.name)
        ],
        ablations=[
            ablation.compare(
                each.interpretation.name, mode, each.outcome.adaptive[mode], constant, 80.0
            )
            for each in (other, shown)
            for mode in (0, 1, 4, 5)
        ],
        front=[(80.0, drives(0.6, 1005)), (240.0, drives(0.9, 335))],
        proposed_vs_paper=[
            own_design.compared_with_paper(shown, mode.number, drives(0.1, 30), knows_road=True)
            for mode in shown.platform.modes
        ],
        sensitivity=None,
        unusable={"broken": "broken.toml: `wake_up.t_max_ms` = 100"},
        duration_s=1.0,
    )
