"""User-defined estimators, policies and localizers: the documented ones, and invalid ones."""

from __future__ import annotations

import functools
import itertools
import random
import re
import runpy
import sys
import warnings
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import access_av
from conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable

DOCS = (ROOT / "docs/plug-ins.md").read_text(encoding="utf-8")
SHORT = access_av.Scenario.load("paper-real-odometry-2").with_overrides(
    {"motion.start_at_m": 280.0, "vehicle.integrity.enabled": False}
)


def test_documented_examples_run(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", DOCS, flags=re.DOTALL):
        exec(block, names)
    printed = capsys.readouterr().out
    errors_m = [float(number) for number in re.findall(r"([\d.]+) m", printed)]
    # The accuracy is that of the built-in localizer, except for the loss of a plain filter without
    # a map.
    assert len(errors_m) == 4, printed
    assert max(errors_m) < 0.6, printed


def bartlett(snapshots: np.ndarray) -> float:
    angles_rad = np.linspace(0.0, np.pi, 361)
    steering = np.exp(1j * np.pi * np.outer(np.cos(angles_rad), np.arange(len(snapshots))))
    return float(angles_rad[(abs(steering.conj() @ snapshots) ** 2).sum(axis=1).argmax()])


def test_without_sigma_the_bound_is_used_and_reported_once() -> None:
    with pytest.warns(UserWarning, match="Cramer-Rao") as said:
        result = access_av.simulate(SHORT, runs=3, keep_trajectories=True, estimator=bartlett)
    assert len(said) == 1
    assert result.aoa_estimates is not None
    accepted = result.aoa_estimates["accepted"]
    assert accepted.mean() > 0.9  # type: ignore[operator]
    built_in = access_av.simulate(SHORT, runs=3, keep_trajectories=True)
    assert built_in.aoa_estimates is not None
    sigmas = [
        table["phase_sigma_rad"].median()
        for table in (result.aoa_estimates, built_in.aoa_estimates)
    ]
    # Maximum likelihood reports the bound at the measured SNR, apart from fading.
    assert 0.8 < sigmas[0] / sigmas[1] < 1.25  # type: ignore[operator]


def test_a_likelihood_is_as_accurate_as_its_maximum() -> None:
    phases = np.arange(-np.pi, np.pi, 2.0 * np.pi / 720)
    steering = np.exp(1j * np.outer(phases, np.arange(4)))

    def likelihood(snapshots: np.ndarray) -> np.ndarray:
        return (abs(steering.conj() @ snapshots) ** 2).sum(axis=1) / 4.0

    custom = access_av.simulate(SHORT, runs=2, estimator=likelihood)
    built_in = access_av.simulate(SHORT, runs=2)
    assert custom.rms_error_m < 1.2 * built_in.rms_error_m


@pytest.mark.parametrize(
    ("returned", "named"),
    [
        (12345.0, "between 0 and pi"),
        (float("nan"), "between 0 and pi"),
        ((1.0, -0.1), "must be above 0"),
        ((1.0, float("nan")), "must be above 0"),
        ("left", "returned a str"),
        (np.full(360, np.nan), "log-likelihood"),
        (np.zeros(3), "log-likelihood"),
    ],
)
def test_invalid_estimates_are_rejected(returned: Any, named: str) -> None:
    with pytest.raises(ValueError, match=named) as raised:
        access_av.simulate(SHORT, estimator=lambda _: returned)
    if hasattr(raised.value, "__notes__"):
        assert "pci 1, index 0" in raised.value.__notes__[0]


class Stating:
    """An estimator with optional energy or time of an estimate."""

    def __init__(self, **stated: Any) -> None:
        vars(self).update(stated)

    def __call__(self, snapshots: np.ndarray) -> tuple[float, float]:
        return bartlett(snapshots), 0.02


def test_the_energy_of_a_plug_in_estimator_is_its_own_specification() -> None:
    board = access_av.Platform.load("jetson-agx-xavier-engine")

    def joules(column: str, **stated: Any) -> list[float | None]:
        runs = access_av.simulate(SHORT, estimator=lambda: Stating(**stated), platform=board).runs
        return [runs[column].item(), runs["aoa_estimates"].item()]

    assert joules("energy_j")[0] is None
    energy_j, aoa_estimates = joules("energy_aoa_estimates_j", energy_per_execution_j=0.01)
    assert energy_j == pytest.approx(0.01 * aoa_estimates)
    # The energy is proportional to the processor time.
    one, two = (
        joules("energy_aoa_estimates_j", time_per_execution_s=time_s)[0] for time_s in (1e-3, 2e-3)
    )
    assert two == pytest.approx(2.0 * one)
    assert 0.1 < one / (1e-3 * aoa_estimates) < 30.0, "watts of a core"


@pytest.mark.parametrize(
    ("stated", "named"),
    [
        ({"energy_per_execution_j": -1.0}, "energy_per_execution_j"),
        ({"energy_per_execution_j": float("nan")}, "finite"),
        ({"time_per_execution_s": "long"}, "time_per_execution_s"),
        ({"energy_per_execution_j": 1.0, "time_per_execution_s": 1.0}, "both"),
    ],
)
def test_invalid_energies_of_an_estimator_are_rejected(stated: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        access_av.simulate(SHORT, estimator=lambda: Stating(**stated))


def test_an_unknown_method_names_the_platform_key_to_set() -> None:
    scenario = access_av.Scenario.load("paper").with_overrides(
        {"vehicle.estimator.method": "maximum-likelihood"}
    )
    with pytest.raises(access_av.SettingsError, match=r"`wake_up\.trigger\.base_ms`") as refused:
        access_av.simulate(scenario)
    assert "duration of one estimate" in str(refused.value)
    stated = scenario.with_overrides({"vehicle.wake_up.trigger.base_ms": 20.0})
    assert access_av.simulate(stated).runs["energy_j"].item() is None


def test_an_estimator_may_return_no_angle() -> None:
    result = access_av.simulate(SHORT, keep_trajectories=True, estimator=lambda _: None)
    assert result.aoa_estimates is not None
    assert set(result.aoa_estimates["reason"]) == {"unusable"}


def raising(*_: Any) -> Any:
    raise KeyError("mine")


@pytest.mark.parametrize("place", ["estimator", "policy", "localizer"])
def test_exceptions_are_passed_unchanged(place: str) -> None:
    with pytest.raises(KeyError, match="mine"):
        access_av.simulate(SHORT, **{place: raising})  # type: ignore[arg-type]


@pytest.mark.parametrize("returned", [None, 3, [True], "yes", [1.0, 2.0]])
def test_invalid_answers_of_a_policy_are_rejected(returned: Any) -> None:
    with pytest.raises(ValueError, match="policy returned"):
        access_av.simulate(SHORT, policy=lambda _: returned)


def test_a_policy_receives_the_situation() -> None:
    seen: list[Any] = []

    class Policy:
        wake_up_time_s = 0.5

        def listens(self, situation: Any) -> bool:
            assert situation.sensed == []
            return round(situation.time_s * 50) % 2 == 0

        def __call__(self, situation: Any) -> list[bool]:
            seen.append(situation)
            return [ssb.pci == 2 for ssb in situation.sensed]

    result = access_av.simulate(SHORT, keep_trajectories=True, policy=Policy)
    assert result.aoa_estimates is not None
    assert set(result.aoa_estimates["pci"]) == {2}
    assert set(result.aoa_estimates["wake_up_time_s"]) == {0.5}
    assert result.aoa_estimates.height == len(seen) == result.runs["bursts_received"][0]
    first = seen[0]
    assert [head.pci for head in first.heads] == [1, 2]
    assert first.heads[0].x_m == 205.0
    assert abs(first.sensed[0].snr_db - first.sensed[0].expected_snr_db) < 15.0
    assert len(first.covariance) == 3


class EveryMetre:
    """A policy with state: one burst for each metre driven."""

    def __init__(self, gap_m: float = 1.0) -> None:
        self.gap_m = gap_m
        self.last: tuple[float, float] | None = None

    def __call__(self, situation: Any) -> bool:
        here = (situation.x_m, situation.y_m)
        if self.last is not None and np.hypot(*np.subtract(here, self.last)) < self.gap_m:
            return False
        self.last = here
        return True


class Smoothed:
    """An estimator with state: the mean of the last two angles."""

    def __init__(self, site: dict[str, Any], vehicle: dict[str, Any], start: Any) -> None:
        assert len(site["radio_heads"]) == 2
        assert len(start) == 3
        self.last_rad: float | None = None

    def __call__(self, snapshots: np.ndarray) -> tuple[float, float]:
        now_rad = bartlett(snapshots)
        mean_rad = now_rad if self.last_rad is None else 0.5 * (now_rad + self.last_rad)
        self.last_rad = now_rad
        return mean_rad, 0.2


def driven(threads: int, **plug_ins: Any) -> dict[str, bytes]:
    """Bytes of all tables of six runs."""
    result = access_av.simulate(SHORT, runs=6, threads=threads, keep_trajectories=True, **plug_ins)
    tables = {name: getattr(result, name) for name in ("runs", "trajectories", "aoa_estimates")}
    return {name: table.write_ipc(None).getvalue() for name, table in tables.items()}


@pytest.mark.parametrize(
    "plug_ins",
    [
        {"policy": EveryMetre},
        {"policy": functools.partial(EveryMetre, 2.0)},
        {"policy": lambda: EveryMetre(gap_m=0.5)},
        {"policy": lambda site, vehicle, start: EveryMetre()},
        {"estimator": Smoothed},
    ],
    ids=["class", "partial", "function", "settings", "estimator"],
)
def test_stateful_plug_ins_give_the_same_bytes_with_any_number_of_threads(
    plug_ins: dict[str, Any],
) -> None:
    one = driven(1, **plug_ins)
    assert driven(2, **plug_ins) == one
    assert driven(4, **plug_ins) == one


def test_stateful_plug_ins_give_the_same_bytes_on_dask() -> None:
    distributed = pytest.importorskip("distributed", reason="the extra `dask` is not installed")
    import cloudpickle

    # Workers cannot import the tests: send them by value.
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    with (
        warnings.catch_warnings(),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        warnings.simplefilter("ignore")
        found = client.gather(
            [client.submit(driven, count, policy=EveryMetre, pure=False) for count in (1, 2)]
        )
    assert found[0] == found[1] == driven(1, policy=EveryMetre)


def test_an_object_that_all_runs_would_share_is_rejected() -> None:
    shared = EveryMetre()
    for role, plug_in, name in (
        ("policy", shared, "EveryMetre"),
        ("policy", shared.__call__, "EveryMetre"),
        ("estimator", Stating(), "Stating"),
        ("localizer", KeyError("no class"), "KeyError"),
    ):
        with pytest.raises(
            TypeError, match=f"class {name}, which all runs and threads would"
        ) as it:
            access_av.simulate(SHORT, **{role: plug_in})
        assert f"{role}={name} or {role}=lambda: {name}(...)" in str(it.value)
    with pytest.raises(ValueError, match="returned the same EveryMetre for two runs"):
        access_av.simulate(SHORT, runs=2, threads=1, policy=lambda: shared)
    with pytest.raises(TypeError, match="takes 2 arguments"):
        access_av.simulate(SHORT, policy=lambda site, vehicle: EveryMetre())


COUNT = 0
CALLS: list[float] = []
TABLE = {"least_db": 0.0}


def counting(situation: Any) -> bool:
    global COUNT
    COUNT += 1
    return COUNT % 2 == 0


def listing(situation: Any) -> bool:
    CALLS.append(situation.time_s)
    return len(CALLS) % 2 == 0


def with_default(situation: Any, last: dict[str, float] = {}) -> bool:  # noqa: B006
    last["time_s"] = situation.time_s
    return True


def reading(situation: Any) -> bool:
    """Keeps no state: it reads a table, and changes a list of its own."""
    found: list[bool] = []
    found.append(all(ssb.snr_db > TABLE["least_db"] for ssb in situation.sensed))
    return found[0]


def test_a_function_that_keeps_state_is_rejected() -> None:
    last = [0.0]
    count = 0

    def in_a_cell(situation: Any) -> bool:
        nonlocal count
        count += 1
        return True

    def in_a_list(situation: Any) -> bool:
        last[0] = situation.time_s
        return True

    for function, said in (
        (counting, "writes the global variable 'COUNT'"),
        (listing, "changes the list 'CALLS'"),
        (with_default, "changes the dict 'last'"),
        (in_a_cell, "writes the variable 'count'"),
        (in_a_list, "changes the list 'last'"),
    ):
        with pytest.raises(TypeError, match=said):
            access_av.simulate(SHORT, policy=function)
    assert driven(2, policy=reading) == driven(1, policy=reading)


class OfClass:
    """A policy whose state is an attribute of its class."""

    count = 0
    seen: list[float] = []  # noqa: RUF012

    def __call__(self, situation: Any) -> bool:
        type(self).count += 1
        return self.count % 2 == 0


class OfList(OfClass):
    def __call__(self, situation: Any) -> bool:
        self.seen.append(situation.time_s)
        return len(self.seen) % 2 == 0


GENERATOR = np.random.default_rng(1)
NUMBERS = itertools.count()
ARRAY = np.zeros(3)


def drawing(situation: Any) -> bool:
    return bool(GENERATOR.random() < 0.5)


def drawing_globally(situation: Any) -> bool:
    return bool(np.random.random() < 0.5)  # noqa: NPY002


def drawing_by_random(situation: Any) -> bool:
    return random.random() < 0.5


def numbering(situation: Any) -> bool:
    return next(NUMBERS) % 2 == 0


def with_attribute(situation: Any) -> bool:
    with_attribute.count = getattr(with_attribute, "count", 0) + 1  # type: ignore[attr-defined]
    return with_attribute.count % 2 == 0  # type: ignore[attr-defined]


def in_an_array(situation: Any) -> bool:
    np.add(ARRAY, 1.0, out=ARRAY)
    return bool(ARRAY[0] % 2 == 0)


def by_another_function(situation: Any) -> bool:
    return in_an_array(situation)


@pytest.mark.parametrize(
    ("policy", "named"),
    [
        (OfClass, "OfClass.count"),
        (OfList, "OfClass.seen"),
        (lambda: OfClass(), "OfClass.count"),
        (drawing, "GENERATOR"),
        (drawing_globally, "generator of numpy.random"),
        (drawing_by_random, "generator of the module random"),
        (numbering, "NUMBERS"),
        (in_an_array, "ARRAY"),
        (by_another_function, "ARRAY"),
    ],
)
def test_state_that_survives_a_run_causes_a_warning(policy: Any, named: str) -> None:
    with pytest.warns(UserWarning, match=f"the policy keeps state between runs.*{named}"):
        access_av.simulate(SHORT, runs=2, policy=policy)


def test_state_in_function_attributes_causes_a_warning() -> None:
    with pytest.warns(UserWarning, match=r"has changed with_attribute\.count"):
        access_av.simulate(SHORT, runs=2, policy=with_attribute)


def test_plug_ins_without_shared_state_cause_no_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        access_av.simulate(SHORT, runs=2, policy=EveryMetre, estimator=Smoothed)


class Standing:
    """A localizer that always returns the start pose."""

    answer: Any = None

    def __init__(self, site: dict[str, Any], vehicle: dict[str, Any], start: tuple[float, ...]):
        assert site["radio_heads"][0]["name"] == "roadside"
        assert vehicle["array"]["elements"] == 4
        self.start = start

    def odometry(self, *_: Any) -> None: ...

    def angle(self, time_s: float, head: Any, phase_rad: float, sigma_rad: float) -> Any:
        assert head.pci in (1, 2)
        assert sigma_rad > 0.0
        return self.answer

    def pose(self, time_s: float) -> Any:
        return self.start


def with_pose(pose: Any) -> type[Standing]:
    return type("Other", (Standing,), {"pose": lambda self, time_s: pose})


def test_a_plug_in_localizer_replaces_the_built_in_one() -> None:
    result = access_av.simulate(SHORT, keep_trajectories=True, localizer=Standing)
    assert result.trajectories is not None
    moved = result.trajectories["x_m"].n_unique()
    assert moved == 1
    assert result.trajectories["covariance_xx_m2"].null_count() == result.trajectories.height


@pytest.mark.parametrize(
    ("pose", "named"),
    [
        ((1.0, float("nan"), 0.0), "not finite"),
        ((1.0, 2.0), "a value other than"),
        ("here", "a value other than"),
        ((1.0, 2.0, 0.0, [[1.0]]), "a value other than"),
        ((1.0, 2.0, 0.0, -np.eye(3)), "negative"),
    ],
)
def test_invalid_poses_are_rejected(pose: Any, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        access_av.simulate(SHORT, localizer=with_pose(pose))


def test_late_angles_are_processed_by_copies_of_a_localizer() -> None:
    class Filter(Standing):
        """Records the order of its inputs."""

        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            self.times: list[float] = []

        def odometry(self, time_s: float, *_: Any) -> None:
            self.times.append(time_s)

        def angle(self, time_s: float, *_: Any) -> bool:
            assert not self.times or time_s >= self.times[-1]
            return True

    late = SHORT.with_overrides({"ssb_latency_ms": 70.0, "vehicle.wake_up.interval_ms": 200.0})
    result = access_av.simulate(late, keep_trajectories=True, localizer=Filter)
    assert result.aoa_estimates is not None
    assert set(result.aoa_estimates["reason"]) == {"consistent"}


@pytest.mark.parametrize("make", [access_av.Site, access_av.Vehicle, access_av.Scenario])
def test_settings_are_copied_compared_hashed_and_pickled(make: Callable[..., Any]) -> None:
    import copy
    import pickle

    one = make.load("paper")  # type: ignore[attr-defined]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for other in (copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
            assert other == one
            assert hash(other) == hash(one)
    assert one != make.load("yard" if make is not access_av.Vehicle else "tugger")  # type: ignore[attr-defined]


def test_the_learned_estimator_does_not_exceed_the_bayes_bound() -> None:
    learn = SimpleNamespace(**runpy.run_path(str(ROOT / "examples/learned/learn.py")))
    random = np.random.default_rng(3)
    network = learn.Network(random)
    untrained = next(learn.compare(network, random, 400))[1][0]
    network.train(random, 400)
    snr_db, learned, likely, ceiling = next(learn.compare(network, random, 400))
    assert snr_db == -25.0
    assert learned[0] < untrained
    # The error may be below the lower bound by chance only: five standard errors.
    for cost, error in (learned, likely):
        assert cost > ceiling[0] - 5.0 * error
