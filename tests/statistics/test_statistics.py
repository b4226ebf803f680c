"""Statistics compared with manual calculations, tables of quantiles and synthetic runs."""

from __future__ import annotations

import math

import numpy as np
import polars as pl
import pytest

from access_av.statistics import (
    Alarms,
    Consistency,
    Integrity,
    ObtainedRisk,
    bootstrap_interval,
    clopper_pearson,
    exceedance,
    mean_nees,
    nees,
    nees_band,
    percentiles,
)
from access_av.statistics.paired import paired_difference, paired_mean


@pytest.mark.parametrize("wrong", [0.0, 1.0, -0.1, math.nan])
def test_unusable_probabilities_are_refused(wrong: float) -> None:
    for refuse in (
        lambda: nees_band(1, probability=wrong),
        lambda: clopper_pearson(1, 2, probability=wrong),
        lambda: bootstrap_interval([1.0], np.mean, probability=wrong),
    ):
        with pytest.raises(ValueError, match="probability"):
            refuse()


def test_intervals_of_proportions_equal_published_examples() -> None:
    # Worked examples of Agresti and Coull (1998) and of R's binom.test.
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 0.3084971), abs=1e-6)
    assert clopper_pearson(10, 10) == pytest.approx((0.6915029, 1.0), abs=1e-6)
    assert clopper_pearson(2, 20) == pytest.approx((0.0123485, 0.3169827), abs=1e-6)
    # 1e6 epochs: 1 − 0.025^(1/n).
    assert clopper_pearson(0, 10**6)[1] == pytest.approx(-math.log(0.025) / 1e6, rel=1e-5)
    for successes, trials in ((3, 2), (-1, 2), (0, 0)):
        with pytest.raises(ValueError, match="trial"):
            clopper_pearson(successes, trials)


def test_clopper_pearson_has_its_coverage() -> None:
    successes = np.random.default_rng(1).binomial(50, 0.1, size=2000)
    ends = {count: clopper_pearson(count, 50) for count in np.unique(successes).tolist()}
    covered = np.mean([ends[count][0] <= 0.1 <= ends[count][1] for count in successes.tolist()])
    assert covered >= 0.95 - 3 * math.sqrt(0.95 * 0.05 / 2000)


def test_bootstrap_interval_of_a_mean_is_two_standard_errors_wide() -> None:
    # 0 … 99: mean 49.5, standard deviation 28.87, standard error 2.887. 2000 resamples place the
    # 2.5 % quantile to about 0.06 standard errors.
    ends = bootstrap_interval(np.arange(100.0), np.mean)
    for end, sign in zip(ends, (-1, 1), strict=True):
        assert abs(end - (49.5 + sign * 1.96 * 2.887)) < 4 * 0.06 * 2.887
    assert bootstrap_interval(np.arange(100.0), np.mean) == ends
    assert bootstrap_interval(np.arange(100.0), np.mean, seed=1) != ends
    assert bootstrap_interval([7.0], np.mean) == (7.0, 7.0)
    with pytest.raises(ValueError, match="at least one run"):
        bootstrap_interval([], np.mean)


def test_nees_band_is_that_of_chi_squared() -> None:
    assert nees_band(1) == pytest.approx((0.050636, 7.377759), rel=1e-5)
    assert nees_band(100) == pytest.approx((1.62728, 2.41058), rel=1e-5)
    assert nees_band(50, probability=0.99, dimensions=3) == pytest.approx(
        (109.142 / 50, 198.360 / 50), rel=1e-4
    )
    with pytest.raises(ValueError, match="runs"):
        nees_band(0)


def drives(
    rng: np.random.Generator, runs: int, steps: int, *, stretch: float = 1.0
) -> pl.DataFrame:
    """Errors drawn from a rotated, changing error ellipse, scaled by ``stretch``."""
    tables = []
    for run in range(runs):
        turn = rng.uniform(0, np.pi, steps)
        axes = np.stack([np.cos(turn), np.sin(turn)]), np.stack([-np.sin(turn), np.cos(turn)])
        stds = rng.uniform(0.1, 1.0, (2, steps))
        drawn = stretch * stds * rng.normal(size=(2, steps))
        x_m, y_m = drawn[0] * axes[0] + drawn[1] * axes[1]
        xx, yy = (
            sum(s**2 * axis[i] ** 2 for s, axis in zip(stds, axes, strict=True)) for i in (0, 1)
        )
        xy = sum(s**2 * axis[0] * axis[1] for s, axis in zip(stds, axes, strict=True))
        tables.append(
            pl.DataFrame(
                {
                    "run": np.full(steps, run),
                    "time_s": 0.02 * np.arange(steps),
                    "searching": np.zeros(steps, dtype=bool),
                    "error_x_m": x_m,
                    "error_y_m": y_m,
                    "covariance_xx_m2": xx,
                    "covariance_yy_m2": yy,
                    "covariance_xy_m2": xy,
                }
            )
        )
    return pl.concat(tables)


def test_a_consistent_localizer_is_found_consistent() -> None:
    table = drives(np.random.default_rng(2), runs=40, steps=400)
    found = Consistency.of(table)
    assert found.runs == 40
    assert all(Consistency.of(table) == found for _ in range(5))
    assert found.anees is not None
    assert found.anees_interval is not None
    assert found.in_band is not None
    # 16 000 independent draws of a mean of 1 with standard deviation 1.
    assert abs(found.anees - 1.0) < 4 / math.sqrt(16_000)
    low, high = found.anees_interval
    assert high - low == pytest.approx(2 * 1.96 / math.sqrt(16_000), rel=0.35)
    assert abs(found.in_band - 0.95) < 4 * math.sqrt(0.95 * 0.05 / 400)
    assert found.predicted_rms_error_m == pytest.approx(found.rms_error_m, rel=0.05)


def test_an_overconfident_localizer_is_detected() -> None:
    found = Consistency.of(drives(np.random.default_rng(3), runs=20, steps=200, stretch=1.5))
    assert found.anees == pytest.approx(2.25, rel=0.1)
    assert found.in_band is not None
    assert found.in_band < 0.5


def test_nees_equals_a_manual_calculation() -> None:
    # P = [[4, 2], [2, 3]], P⁻¹ = [[3, −2], [−2, 4]] / 8; e = (1, 2): (3 − 8 + 16) / 8.
    step = {
        "run": 0, "time_s": 0.0, "searching": False, "error_x_m": 1.0, "error_y_m": 2.0,
        "covariance_xx_m2": 4.0, "covariance_xy_m2": 2.0, "covariance_yy_m2": 3.0,
    }  # fmt: skip
    rows = [
        step,
        step | {"time_s": 1.0, "searching": True},
        step | {"time_s": 2.0, "covariance_xx_m2": 0.0, "covariance_xy_m2": 0.0},
        step | {"time_s": 3.0, "covariance_xx_m2": None},
    ]
    table = pl.DataFrame(rows)
    assert nees(table)["nees"].to_list() == [pytest.approx(11 / 8), None, None, None]
    means = mean_nees(
        pl.concat([table, table.with_columns(run=pl.lit(1, pl.Int64), error_x_m=0.0)])
    )
    # The other run: 16 / 8.
    assert means.row(0, named=True) == {
        "time_s": 0.0, "runs": 2, "mean_nees": pytest.approx(27 / 16),
        "band_low": pytest.approx(0.242209, rel=1e-5),
        "band_high": pytest.approx(5.571643, rel=1e-5), "in_band": True,
    }  # fmt: skip
    assert means.height == 1


def test_the_start_can_be_left_out_and_searching_counts_nowhere() -> None:
    table = drives(np.random.default_rng(4), runs=2, steps=10)
    first = pl.col("time_s") == 0.0
    wild = table.with_columns(error_x_m=pl.when(first).then(1e6).otherwise("error_x_m"))
    assert Consistency.of(wild, skip=1).anees == Consistency.of(table, skip=1).anees
    searching = wild.with_columns(searching=first)
    assert Consistency.of(searching).anees == Consistency.of(table, skip=1).anees
    assert Consistency.of(searching).rms_error_m < 10.0  # type: ignore[operator]


def test_without_covariances_only_errors_are_reported() -> None:
    table = drives(np.random.default_rng(5), runs=2, steps=10).with_columns(
        pl.lit(None, pl.Float64).alias(f"covariance_{axes}_m2") for axes in ("xx", "xy", "yy")
    )
    found = Consistency.of(table)
    assert (found.anees, found.anees_interval, found.in_band) == (None, None, None)
    assert found.predicted_rms_error_m is None
    assert found.rms_error_m is not None
    assert found.rms_error_m > 0.0


def test_a_vehicle_that_was_never_found_has_no_error() -> None:
    table = drives(np.random.default_rng(6), runs=2, steps=10).with_columns(searching=True)
    found = Consistency.of(table)
    assert (found.rms_error_m, found.p90_error_m, found.anees) == (None, None, None)
    settled_nowhere = Consistency.of(table.with_columns(searching=False), skip=10)
    assert settled_nowhere.anees is None
    assert settled_nowhere.rms_error_m is not None


def guarded(*steps: tuple[float, float | None, str | None], run: int = 0) -> pl.DataFrame:
    """Steps a second apart: horizontal error, protection level, state."""
    return pl.DataFrame(
        {
            "run": [run] * len(steps),
            "time_s": [float(number) for number in range(len(steps))],
            "error_x_m": [0.6 * error_m for error_m, _, _ in steps],
            "error_y_m": [-0.8 * error_m for error_m, _, _ in steps],
            "protection_level_m": [level_m for _, level_m, _ in steps],
            "integrity": [state for _, _, state in steps],
        },
        schema_overrides={"protection_level_m": pl.Float64, "integrity": pl.String},
    )


def test_integrity_statistics_equal_a_manual_count() -> None:
    table = guarded(
        (0.5, 1.0, "ok"),
        (0.2, 0.1, "ok"),
        (1.0, 4.0, "degraded"),
        (5.0, 1.0, "unavailable"),
        (1.0, None, None),
    )
    # Ratios 2, 0.5, 4 and 0.2.
    found = Integrity.of(table)
    assert found is not None
    assert (found.runs, found.epochs) == (1, 4)
    assert found.state_shares == {"ok": 0.5, "degraded": 0.25, "unavailable": 0.25}
    assert found.availability == 0.5
    assert found.median_level_over_error == pytest.approx(1.25)
    assert (found.exceedances, found.runs_with_exceedances) == (1, 1)
    assert found.exceedance_share == 0.5
    # One run, drawn again and again.
    assert found.exceedance_interval == (0.5, 0.5)
    assert found.run_interval == pytest.approx((0.025, 1.0))
    assert Integrity.of(table.tail(1)) is None


def test_exceedance_intervals_use_runs_instead_of_epochs() -> None:
    good = [guarded(*[(0.1, 1.0, "ok")] * 50, run=run) for run in range(19)]
    bad = guarded(*[(2.0, 1.0, "ok")] * 50, run=19)
    found = Integrity.of(pl.concat([*good, bad]))
    assert found is not None
    assert found.exceedance_share == 0.05
    # Interval over epochs: 3.7 to 6.5 %. Interval over runs: 0 to 15 %.
    low, high = found.exceedance_interval
    assert low == 0.0
    assert high in (0.1, 0.15, 0.2)
    assert found.run_interval == pytest.approx((0.0012651, 0.2487328), abs=1e-6)


def test_alarm_statistics_equal_a_manual_count() -> None:
    steps = (
        (0.1, 0.8, "ok"),
        (0.1, 0.8, "degraded"),  # an early alarm
        (0.5, 0.4, "ok"),
        (2.0, 9.0, "ok"),  # above the alert limit, without an alarm for 0 s ...
        (2.0, 9.0, "ok"),  # ... 1 s ...
        (2.0, 9.0, "degraded"),
        (2.0, 9.0, "ok"),  # ... and again 3 s after it began
        (0.5, 9.0, "ok"),
        (2.0, 9.0, "degraded"),  # a timely alarm
    )
    found = Alarms.of(guarded(*steps), alert_limit_m=1.5)
    assert found is not None
    assert found == Alarms(
        alarms=3, early=1, suspicions=1, excursions=2, longest_silence_s=3.0, duration_s=8.0
    )
    twice = Alarms.of(pl.concat([guarded(*steps), guarded(*steps, run=1)]), alert_limit_m=1.5)
    assert twice is not None
    assert (twice.alarms, twice.excursions, twice.longest_silence_s) == (6, 4, 3.0)
    assert twice.per_hour(twice.early) == pytest.approx(450.0)
    assert Alarms.of(guarded((1.0, None, None)), alert_limit_m=1.5) is None


@pytest.mark.parametrize("shape", [0.0, 0.15, 0.3])
def test_peaks_over_a_threshold_find_known_tails(shape: float) -> None:
    """The mean estimate from 20 samples of 5000 is correct far beyond the empirical range."""
    rng = np.random.default_rng(3)
    truth = 1e-6
    exponential = rng.exponential(size=(20, 5000))
    grown = (lambda x: np.expm1(shape * x) / shape) if shape else (lambda x: x)
    level = float(grown(-np.log(truth)))
    found = [exceedance(sample, level) for sample in grown(exponential)]
    # One sample determines the rate within a factor of about ten (500 peaks: ξ ± 0.05 over ln 1e5).
    assert 0.2 < np.median(found) / truth < 5.0
    assert max(found) < 1000.0 * truth


def test_peaks_over_a_threshold_are_counted_where_they_can_be() -> None:
    values = np.arange(1000) / 1000.0
    assert exceedance(values, 0.5) == pytest.approx(0.499)
    assert exceedance(np.zeros(1000), 0.5) == 0.0
    assert exceedance([], 0.5) == 0.0


def test_estimated_risk_equals_that_of_a_gaussian() -> None:
    rng = np.random.default_rng(5)
    runs, blocks = 60, 40
    # Two epochs in a block, the second with the error of the first: one independent error each.
    error = np.repeat(rng.standard_normal(runs * blocks), 2)
    steps = pl.DataFrame(
        {
            "run": np.repeat(np.arange(runs), 2 * blocks),
            "time_s": np.tile(np.arange(2 * blocks) * 5.0, runs),
            "error_x_m": error,
            "error_y_m": np.zeros(len(error)),
            "protection_level_m": np.full(len(error), 4.5),
            "integrity": ["ok"] * len(error),
        }
    )
    found = ObtainedRisk.of(steps, 10.0)
    assert found is not None
    asked = 360.0 * math.erfc(4.5 / math.sqrt(2.0))
    low, high = found.interval
    assert low < asked < high
    assert high < 100.0 * asked
    # Without ``ok`` epochs there is no integrity risk.
    assert ObtainedRisk.of(steps.with_columns(integrity=pl.lit("degraded")), 10.0) is None


# Percentiles.


def test_percentiles_are_those_of_all_and_their_intervals_of_whole_runs() -> None:
    """Compares with the definition, run by run; one run has no values in its second half."""
    rng = np.random.default_rng(3)
    errors = np.abs(rng.standard_normal((7, 60))) * rng.lognormal(0.0, 0.5, (7, 1))
    errors[2, 30:] = np.nan
    found = percentiles(errors, [50.0, 90.0, 99.0], resamples=200, seed=5)
    drawn = np.random.default_rng(5).multinomial(7, np.full(7, 1.0 / 7.0), size=200)
    for each in found:

        def of(rows: np.ndarray, percent: float = each.percent) -> float:
            return float(np.nanquantile(rows, percent / 100.0, method="inverted_cdf"))

        assert each.value == of(errors)
        repeated = sorted(of(np.repeat(errors, times, axis=0)) for times in drawn)
        outside = repeated.index(each.low)
        assert repeated[-1 - outside] == each.high
        assert outside < 0.025 * 200


def test_percentile_intervals_have_their_coverage() -> None:
    """With forty runs; the interval of the 99th percentile is too short if the runs differ."""
    rng = np.random.default_rng(11)
    many = np.abs(rng.standard_normal((4000, 60))) * rng.lognormal(0.0, 0.5, (4000, 1))
    true = dict(zip((50.0, 90.0), np.quantile(many, (0.5, 0.9)), strict=True))
    held = dict.fromkeys(true, 0)
    trials = 150
    for _ in range(trials):
        errors = np.abs(rng.standard_normal((40, 60))) * rng.lognormal(0.0, 0.5, (40, 1))
        for each in percentiles(errors, list(true), resamples=200):
            assert each.low is not None
            assert each.high is not None
            held[each.percent] += each.low <= true[each.percent] <= each.high
    # Expected number of 150 intervals of 95 % that contain the true value: 142.5 ± 2.7.
    assert min(held.values()) >= 142.5 - 4.0 * 2.7


def test_rare_events_have_an_infinite_upper_end() -> None:
    errors = np.abs(np.random.default_rng(2).standard_normal((20, 100)))
    few, enough = (percentiles(errors, [99.0], independent=it)[0] for it in (300, 2000))
    # 367 errors within a limit show with 97.5 % confidence that 99 % are: 0.99**367 < 0.025.
    assert few.high == np.inf
    assert enough.high is not None
    assert few.value == enough.value < enough.high < np.inf
    [alone] = percentiles(errors[:1], [99.0])
    assert (alone.low, alone.high) == (None, None)
    unknown = np.where(np.arange(100) < 98, errors, np.inf)
    assert percentiles(unknown, [99.0])[0].value == np.inf
    with pytest.raises(ValueError, match="percentile 0"):
        percentiles(errors, [0.0])


def test_paired_differences_are_plain_numbers() -> None:
    errors = np.random.default_rng(1).random((3, 50))
    found = [*paired_difference(errors, 2.0 * errors, 90.0), *paired_mean(errors[0], errors[1])]
    # A comparison of NumPy's numbers has a type that JSON does not support.
    assert {type(it) for it in found} == {float}
