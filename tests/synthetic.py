"""An evaluation made up of smooth curves, for tests of what comes after the simulation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import polars as pl

from access_av.paper.evaluation import Evaluation, cases
from access_av.platform import Figure, PowerMode

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


def platform() -> SimpleNamespace:
    modes = [
        PowerMode(
            number=number,
            name=f"MODE_{number}",
            cpu_hz=mhz * 1e6,
            base_wake_up_ms=dict(zip(METHODS, map(float, times), strict=True)),
            energy_per_execution_j={
                method: Figure(MUSIC_J[number] * factor, "fitted", "a test", "marginal")
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
    )


def evaluation() -> Evaluation:
    board = platform()
    time_s = np.arange(0.0, 80.33, 0.02)
    points, errors = [], {}
    for case in cases(board):
        setting = case.setting
        worst_y = 0.2 if setting.adaptive else WORST_Y_M[setting.method]
        if setting.adaptive:
            executions = float(ADAPTIVE_EXECUTIONS[int(setting.base_wake_up_ms)])
        else:
            executions = float(int(80_330 / setting.base_wake_up_ms) + 1)
        error_y = worst_y * (time_s / time_s[-1]) ** 1.5
        errors[setting] = pl.DataFrame(
            {"time_s": time_s, "mean_abs_error_x_m": error_y / 10, "mean_abs_error_y_m": error_y}
        ).select(
            pl.lit(setting.method).alias("method"),
            pl.lit(setting.adaptive).alias("adaptive"),
            pl.lit(setting.base_wake_up_ms).alias("base_wake_up_ms"),
            pl.all(),
        )
        energy = case.mode.energy_per_execution_j[setting.method] if case.mode else None
        points.append(
            {
                "campaign": case.campaign,
                "mode": case.mode.number if case.mode else None,
                "mode_name": case.mode.name if case.mode else None,
                "method": setting.method,
                "adaptive": setting.adaptive,
                "base_wake_up_ms": setting.base_wake_up_ms,
                "executions": executions,
                "worst_error_x_m": worst_y / 10,
                "worst_error_y_m": worst_y,
                "rms_error_m": worst_y * 0.6,
                "energy_per_execution_j": energy.value if energy else None,
                "energy_j": executions * energy.value if energy else None,
                "energy_provenance": energy.provenance if energy else None,
            }
        )
    return Evaluation(
        points=pl.DataFrame(points, infer_schema_length=None),
        errors=pl.concat(errors.values()),
        snr=pl.DataFrame({"time_s": time_s, "mean_true_snr_db": 1 + 9 * np.sin(time_s / 35) ** 2}),
        scenario=SimpleNamespace(name="synthetic", to_toml=lambda: 'name = "synthetic"\n'),
        platform=board,
        runs=2,
        seed=1,
        duration_s=1.0,
    )
