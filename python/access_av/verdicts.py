"""Verdicts and states of results, and their wording."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


class Judgement(Enum):
    """Whether runs meet the target; `study.json` contains the value."""

    MET = "met"
    PROBABLY_MET = "probably_met"
    PROBABLY_MISSED = "probably_missed"
    MISSED = "missed"

    @classmethod
    def of(cls, share: tuple[float, float, float], percent: float) -> Judgement:
        """Returns the judgement of a share of the time with the ends of its 95 % interval.

        Examples
        --------
        >>> Judgement.of((0.97, 0.94, 0.99), 95.0), Judgement.of((0.97, 0.96, 0.99), 95.0)
        (<Judgement.PROBABLY_MET: 'probably_met'>, <Judgement.MET: 'met'>)
        """
        value, low, high = share
        required = 0.01 * percent
        if low >= required:
            return cls.MET
        if high < required:
            return cls.MISSED
        return cls.PROBABLY_MET if value >= required else cls.PROBABLY_MISSED

    @classmethod
    def of_all(cls, each: Iterable[Judgement]) -> Judgement:
        """Returns the judgement of several targets: the worst one.

        Examples
        --------
        >>> Judgement.of_all([Judgement.MET, Judgement.PROBABLY_MISSED])
        <Judgement.PROBABLY_MISSED: 'probably_missed'>
        """
        order = list(cls)
        return max(each, key=order.index)

    @property
    def holds(self) -> bool:
        """Whether the estimated share meets the target, with or without 95 % confidence."""
        return self in (Judgement.MET, Judgement.PROBABLY_MET)

    @property
    def words(self) -> str:
        """The wording for reports.

        Examples
        --------
        >>> Judgement.PROBABLY_MET.words
        'probably good enough'
        """
        return _JUDGEMENTS[self][0]

    @property
    def badge(self) -> str:
        """Kind of the badge of a page: ``yes``, ``fit`` or ``no``."""
        return _JUDGEMENTS[self][1]


class Effect(Enum):
    """Effect of a remedy on the error; `study.json` contains the value."""

    HELPS = "helps"
    UNCERTAIN = "uncertain"
    HARMS = "harms"

    @property
    def words(self) -> str:
        """The wording for reports.

        Examples
        --------
        >>> [it.words for it in Effect]
        ['helps', 'not sure', 'makes it worse']
        """
        return _EFFECTS[self][0]

    @property
    def badge(self) -> str:
        """Kind of the badge of a page: ``yes``, ``fit`` or ``no``."""
        return _EFFECTS[self][1]

    @classmethod
    def of(cls, delta_m: tuple[float, float, float]) -> Effect:
        """Returns the effect by a difference to the baseline with its 95 % interval.

        Examples
        --------
        >>> Effect.of((-0.2, -0.3, -0.1)), Effect.of((0.1, -0.1, 0.3))
        (<Effect.HELPS: 'helps'>, <Effect.UNCERTAIN: 'uncertain'>)
        """
        _, low, high = delta_m
        if high < 0.0:
            return cls.HELPS
        return cls.HARMS if low > 0.0 else cls.UNCERTAIN


class NotOk(Enum):
    """Reason for a state other than ``ok``; `study.json` contains the value."""

    LEVEL = "level"
    SUSPECTED = "suspected"
    CONTRADICTED = "contradicted"

    @property
    def words(self) -> str:
        """The wording for reports.

        Examples
        --------
        >>> NotOk.LEVEL.words
        'level above the alert limit'
        """
        return _REASONS[self]


class Cause(Enum):
    """Cause of an unavailable position."""

    SEARCHING = "searching"
    CONTRADICTED = "contradicted"
    TOO_WIDE = "too_wide"
    SUSPECTED = "suspected"

    def words(self, alert_limit_m: float) -> str:
        """Returns the wording for reports, with the alert limit of the vehicle in metres.

        Examples
        --------
        >>> Cause.TOO_WIDE.words(1.5)
        'protection level above the alert limit of 1.5 m'
        """
        return _CAUSES[self][0].format(limit_m=alert_limit_m)

    @property
    def remedy(self) -> str:
        """Measures against the cause."""
        return _CAUSES[self][1]


class LevelResult(Enum):
    """Whether runs reach a 3GPP positioning service level; the value is the wording."""

    REACHED = "reached"
    TOO_FEW_RUNS = "too few runs"
    NOT_REACHED = "not reached"

    @property
    def badge(self) -> str:
        """Kind of the badge of a page: ``yes``, ``fit`` or ``no``."""
        return _LEVEL_BADGES[self]


class Agreement(Enum):
    """Whether two seeds recommend one operating point; `study.json` contains the value."""

    AGREED = "agreed"
    EQUIVALENT = "equivalent"
    UNDECIDED = "undecided"


_JUDGEMENTS = {
    Judgement.MET: ("good enough", "yes"),
    Judgement.PROBABLY_MET: ("probably good enough", "fit"),
    Judgement.PROBABLY_MISSED: ("probably not good enough", "fit"),
    Judgement.MISSED: ("not good enough", "no"),
}
_EFFECTS = {
    Effect.HELPS: ("helps", "yes"),
    Effect.UNCERTAIN: ("not sure", "fit"),
    Effect.HARMS: ("makes it worse", "no"),
}
_REASONS = {
    NotOk.LEVEL: "level above the alert limit",
    NotOk.SUSPECTED: "suspected fault",
    NotOk.CONTRADICTED: "position lost",
}
_LEVEL_BADGES = {
    LevelResult.REACHED: "yes",
    LevelResult.TOO_FEW_RUNS: "fit",
    LevelResult.NOT_REACHED: "no",
}
_CAUSES = {
    Cause.SEARCHING: (
        "first position not found yet",
        "a start pose, or more radio heads near the start",
    ),
    Cause.CONTRADICTED: (
        "contradictions between radio heads, array and odometer",
        "a survey of radio heads and array mounting (access-av record survey)",
    ),
    Cause.TOO_WIDE: (
        "protection level above the alert limit of {limit_m:g} m",
        "more wake-ups, more radio heads, smaller standard deviations, or a higher "
        "integrity.alert_limit_m if the plant permits it",
    ),
    Cause.SUSPECTED: (
        "fault of a radio head, the array or the odometer suspected, now or recently",
        "realistic standard deviations of array, odometer and radio heads, because errors "
        "within them are not faults",
    ),
}
