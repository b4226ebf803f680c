"""Evaluation of the paper under several interpretations, with verdicts and comparisons."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av._core import SettingsError
from access_av.device.platform import Figure, Platform
from access_av.errors import InputError
from access_av.paper import ablation, freedoms, own_design, run_tables
from access_av.paper import chosen as chosen_otherwise
from access_av.paper.claims import Claim, check_claims, with_seeds
from access_av.paper.driver import Driver
from access_av.paper.energy_fit import fit_energy
from access_av.paper.evaluation import Evaluation, cases, demands, evaluate, evaluate_with
from access_av.paper.interpretations import SHIPPED
from access_av.paper.outcome import rows
from access_av.paper.sampled_interpretations import sample
from access_av.paper.unknowns import Unknowns, sobol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from access_av.paper.interpretations import Interpretation
    from access_av.paper.outcome import Drives
    from access_av.paper.own_design import Fair
    from access_av.run.campaign import Campaign

FIT_SOURCE = "access-av paper fit: agrees with the sums and statements of the paper"
# Sizes of `evaluate --sensitivity`: environments, controllers in each, runs per setting.
UNKNOWNS = (512, 2, 8)


@dataclass(frozen=True)
class Study:
    """Evaluation of the paper under several interpretations.

    Attributes
    ----------
    evaluations
        One evaluation per interpretation, in their order.
    claims
        Verdicts of all interpretations.
    ablations
        Each interpretation with a constant in place of the controller, by power mode.
    front
        MUSIC at fixed intervals, in ms.
    proposed_vs_paper
        Proposed method compared with the shipped interpretation, by power mode.
    sensitivity
        Sensitivity of the claims, if requested.
    unusable
        Interpretations that could not be evaluated, with the reason.
    fit_options
        Claims met with each degree of freedom of the energy fit.
    equal_information
        Both methods with equal information, in mode 0.
    effects
        Effects of alternative assumptions.
    """

    evaluations: list[Evaluation]
    claims: list[Claim]
    ablations: list[ablation.Ablation]
    front: list[tuple[float, Drives]]
    proposed_vs_paper: list[own_design.Comparison]
    sensitivity: Unknowns | None
    unusable: Mapping[str, str]
    duration_s: float
    fit_options: list[freedoms.FitOption] = field(default_factory=list)
    equal_information: list[Fair] = field(default_factory=list)
    effects: list[chosen_otherwise.Effect] = field(default_factory=list)

    @property
    def shown(self) -> Evaluation:
        """Evaluation in the report: of the shipped interpretation, otherwise the first."""
        shipped = (each for each in self.evaluations if each.interpretation.name == SHIPPED)
        return next(shipped, self.evaluations[0])

    def of(self, interpretation: str) -> list[Claim]:
        """Returns the claims under one interpretation."""
        return [claim for claim in self.claims if claim.interpretation == interpretation]

    def tables(self) -> dict[str, pl.DataFrame]:
        """Returns the written tables; see :mod:`access_av.columns`."""
        named = {
            name: pl.concat(
                [
                    getattr(each, name).select(
                        pl.lit(each.interpretation.name).alias("interpretation"), pl.all()
                    )
                    for each in self.evaluations
                ]
            )
            for name in ("points", "errors")
        }
        front = [
            {
                "base_wake_up_ms": interval_ms,
                "aoa_estimates": float(drives.aoa_estimates[0]),
                "worst_error_x_m": float(drives.worst_x_m[0]),
                "worst_error_y_m": float(drives.worst_y_m[0]),
                "rms_error_m": float(drives.rms_error_m[0]),
            }
            for interval_ms, drives in self.front
        ]
        tables = {
            "operating_points": named["points"],
            "errors": named["errors"],
            "snr": self.shown.snr,
            "ablations": rows(self.ablations),
            "fixed_front": pl.DataFrame(front),
            "proposed_vs_paper": rows(self.proposed_vs_paper),
            "equal_information": rows(self.equal_information),
            "evaluation_runs": run_tables.joined(self._runs()),
            "resamples": run_tables.joined(
                table for each in self.evaluations for table in run_tables.resamples_of(each)
            ),
        }
        if self.fit_options:
            tables["fit_degrees_of_freedom"] = pl.DataFrame(
                [each.as_row() for each in self.fit_options]
            )
        if self.effects:
            tables["assumptions"] = rows(self.effects)
        if self.sensitivity is not None:
            tables |= self.sensitivity.tables()
        return tables

    def _runs(self) -> Iterator[pl.DataFrame]:
        """Yields the runs of every setting: operating points and their references."""
        for each in self.evaluations:
            yield from run_tables.runs_of(each)
        shown = self.shown.interpretation.name
        for one in self.ablations:
            yield run_tables.of_drives(
                one.constant,
                interpretation=one.interpretation,
                campaign=run_tables.CONSTANT,
                mode=one.mode,
                base_wake_up_ms=one.constant_ms,
            )
        for interval_ms, drives in self.front:
            yield run_tables.of_drives(
                drives,
                interpretation=shown,
                campaign=run_tables.FRONT,
                base_wake_up_ms=interval_ms,
            )
        for mine in self.proposed_vs_paper:
            per_execution_j = self.shown.outcome.energy_per_execution_j[mine.mode].get("music")
            yield run_tables.of_drives(
                mine.ours,
                None if per_execution_j is None else float(per_execution_j.flat[0]),
                interpretation=shown,
                campaign=run_tables.TRACKER,
                mode=mine.mode,
                adaptive=True,
                variant="road map" if mine.map else "no road map",
            )
        for equal in self.equal_information:
            yield run_tables.of_drives(
                equal.drives,
                interpretation=shown,
                campaign=run_tables.EQUAL,
                adaptive=True,
                variant=equal.variant,
            )


def study(
    chosen: Sequence[Interpretation],
    platform: Platform,
    *,
    runs: int,
    seed: int,
    seeds: int = 1,
    threads: int | None = None,
    unknowns: Campaign | None = None,
    stated: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Study:
    """Evaluates interpretations and claims; compares with constants and with the proposed method.

    Parameters
    ----------
    seeds
        Number of seeds for the claims, starting at ``seed``; all other results use ``seed`` only.
    unknowns
        Campaign of the sensitivity analysis. Default: no sensitivity analysis and no alternative
        assumptions.
    stated
        Claims in the format of ``paper.toml``. Default: this file.

    Raises
    ------
    InputError
        If no interpretation can be evaluated; the message contains the reason.
    """
    started = time.monotonic()
    # Per interpretation four adaptive settings and four constants; fixed settings and front once.
    planned = 8 * len(chosen) + len({case.setting for case in cases(platform)}) + 24
    driver = Driver(platform, runs, seed, threads, progress=progress, planned=planned)
    evaluations, ablations, unusable = [], [], {}
    for interpretation in chosen:
        try:
            evaluations.append(evaluate_with(driver, interpretation))
            # Compute the ablation now, while the driver has the traces of this environment.
            ablations += ablation.ablate(driver, evaluations[-1])
        except SettingsError as error:
            unusable[interpretation.name] = str(error)
    if not evaluations:
        raise InputError("; ".join(unusable.values()))
    hangs_on = None
    if unknowns is not None:
        worlds, controllers, drives = UNKNOWNS
        drawn = sample(
            unknowns,
            platform,
            worlds=worlds,
            controllers=controllers,
            runs=drives,
            seed=seed,
            everything=True,
            progress=progress,
        )
        hangs_on = sobol(drawn, drives)
    claims = {seed: judged(evaluations, stated)}
    for other in range(seed + 1, seed + seeds):
        again = Driver(platform, runs, other, threads, count=0, progress=progress, planned=planned)
        claims[other] = judged(
            [evaluate_with(again, each.interpretation) for each in evaluations], stated
        )
    made = Study(
        evaluations=evaluations,
        claims=with_seeds(claims) if seeds > 1 else claims[seed],
        ablations=ablations,
        front=[],
        proposed_vs_paper=[],
        sensitivity=hangs_on,
        unusable=unusable,
        duration_s=0.0,
    )
    shown = made.shown
    of_shown = shown.interpretation.name
    return Study(
        **{
            **vars(made),
            "front": ablation.front(driver, shown.interpretation),
            "proposed_vs_paper": own_design.compare(driver, shown),
            "equal_information": own_design.fair(driver, shown),
            "effects": [] if unknowns is None else chosen_otherwise.effects(driver),
            "fit_options": freedoms.ladder(evaluations, made.claims, of_shown, stated),
            "duration_s": time.monotonic() - started,
        }
    )


def judged(
    evaluations: Sequence[Evaluation], stated: Mapping[str, Any] | None = None
) -> list[Claim]:
    """Returns the claims under every interpretation."""
    return [
        claim
        for each in evaluations
        for claim in check_claims(
            each.outcome,
            interpretation=each.interpretation.name,
            chosen=each.interpretation.chosen,
            freedoms=each.freedoms,
            stated=stated,
        )
    ]


def fit_platform(
    interpretation: str,
    platform: str,
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Platform:
    """Fits the energies per angle estimate to the paper; counts the estimates by simulation.

    Returns
    -------
    Platform
        The platform with fitted energies, each with its provenance.

    See Also
    --------
    access_av.paper.energy_fit.fit_energy : How.
    """
    board = Platform.load(platform)
    found = evaluate(
        interpretation, board, runs=runs, seed=seed, threads=threads, progress=progress
    )
    energies_j = fit_energy(demands(found.outcome, board))
    return board.with_energy(
        {
            mode: {
                method: Figure(round(float(value.item()), 4), "fitted", FIT_SOURCE, "unstated")
                for method, value in by_method.items()
            }
            for mode, by_method in energies_j.items()
        }
    )
