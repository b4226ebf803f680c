"""Interpretations of the paper: scenarios that set the parameters which it does not specify.

An interpretation is a TOML file with ``extends = "paper"`` in ``interpretations/``;
``interpretations/index.toml`` contains their order, and the parameters that were selected in view
of the paper's claims.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from access_av._core import Scenario
from access_av.errors import InputError
from access_av.paper.statements import paper_numbers
from access_av.settings import as_dict
from access_av.tables.toml import shipped

if TYPE_CHECKING:
    from collections.abc import Iterable

OPEN = ("radio", "controller")
# Interpretation of the scenario `paper`.
SHIPPED = "gate"


@dataclass(frozen=True)
class Interpretation:
    """An interpretation of the paper.

    Attributes
    ----------
    chosen
        Parameters of :data:`OPEN` that were selected with the paper's claims known.
    keeps_t_max
        Whether the time between two estimates is meant to be at most t_max.
    """

    name: str
    title: str
    scenario: Scenario
    chosen: tuple[str, ...]
    keeps_t_max: bool

    @property
    def wake_up(self) -> dict[str, Any]:
        """Wake-up settings of the interpretation."""
        return dict(as_dict(self.scenario)["vehicle"]["wake_up"])

    @property
    def is_gated(self) -> bool:
        """Whether estimates wait for a better SSB."""
        return bool(self.wake_up["policy"] == "gated")

    @property
    def t_max_s(self) -> float | None:
        """The paper's t_max in seconds; ``None`` without a controller."""
        resolved = self.scenario.resolved()
        settings = as_dict(resolved)["vehicle"]["wake_up"]
        t_max_ms = settings.get("trigger", settings).get("t_max_ms")
        return None if t_max_ms is None else t_max_ms / 1e3

    def keeps(self, longest_gap_s: float) -> bool:
        """Returns whether a maximum gap is at most t_max plus one SSB period."""
        period_s = paper_numbers()["wake_up"]["ssb_period_ms"] / 1e3
        return self.t_max_s is None or longest_gap_s < self.t_max_s + period_s - 1e-9


def names() -> list[str]:
    """Returns the names of the shipped interpretations, in the order of the evaluation.

    Examples
    --------
    >>> names()[:2]
    ['every-ssb', 'wake-ups']
    """
    return list(shipped("paper", "interpretations", "index.toml"))


def load(name_or_path: str) -> Interpretation:
    """Loads a shipped interpretation by its name, or a scenario file by its path.

    Raises
    ------
    SettingsError
        If the file is invalid; the message contains the key and the allowed values.
    InputError
        If its trip is not the paper's; the message contains a suitable command.

    Examples
    --------
    >>> load("gate-t-max").wake_up["t_max_ms"]
    240.0
    """
    index = shipped("paper", "interpretations", "index.toml")
    if name_or_path in index:
        entry = index[name_or_path]
        with resources.as_file(resources.files(__package__).joinpath("interpretations")) as place:
            scenario = Scenario.load(str(place / f"{name_or_path}.toml"))
        return Interpretation(
            name_or_path, entry["title"], scenario, tuple(entry["chosen"]), entry["keeps_t_max"]
        )
    if not Path(name_or_path).exists() and name_or_path not in Scenario.names():
        raise InputError(
            f"unknown interpretation {name_or_path}; allowed are: {', '.join(index)}; or the "
            f"path of a file"
        )
    scenario = Scenario.load(name_or_path)
    check_trip(scenario)
    title = scenario.description or scenario.name
    return Interpretation(scenario.name, title, scenario, OPEN, keeps_t_max=False)


def load_all(chosen: Iterable[str] = ()) -> list[Interpretation]:
    """Loads these interpretations, or all shipped ones."""
    return [load(name) for name in list(chosen) or names()]


def check_trip(scenario: Scenario) -> None:
    """Rejects a scenario whose trip differs from that of the paper's claims.

    Raises
    ------
    InputError
        The message contains the difference and a suitable command.

    Examples
    --------
    >>> check_trip(Scenario.load("paper"))
    """
    paper = as_dict(Scenario.load("paper"))
    other = as_dict(scenario)
    differs = [
        what
        for what, place in (
            ("its road", ("site", "road")),
            ("the positions of its radio heads", ("site", "radio_heads")),
            ("its motion", ("motion",)),
            ("its top speed", ("vehicle", "top_speed_kmh")),
            ("its localizer", ("vehicle", "localizer", "kind")),
            ("its receiver, which uses pilots,", ("vehicle", "receiver", "pilots")),
        )
        if _at(paper, place) != _at(other, place)
    ]
    if differs:
        raise InputError(
            f"scenario {scenario.name}: {differs[0]} must equal the paper's, because `access-av "
            "paper evaluate` judges claims about this trip; for errors, estimates and energy "
            f"of this scenario: access-av run {scenario.name}; for the smallest error of any "
            f"localizer: access-av design bound {scenario.name}"
        )


def _at(settings: dict[str, Any], place: tuple[str, ...]) -> Any:
    found: Any = settings
    for key in place:
        found = found.get(key, {})
    if place[-1] == "radio_heads":
        return [head["position_m"] for head in found]
    if place[-1] == "road":
        return {key: value for key, value in found.items() if key != "position_std_m"}
    return found
