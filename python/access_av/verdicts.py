"""Verdicts and states of results, and their wording."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from typing_extensions import Self


class Worded(Enum):
    """Enumeration of values with their wording.

    Attributes
    ----------
    words
        The wording for reports.
    badge
        Kind of the badge of a page: ``yes``, ``fit`` or ``no``; empty without a badge.
    """

    words: str
    badge: str

    def __new__(cls, value: str, words: str = "", badge: str = "") -> Self:
        """Creates a member; without ``words``, the value is the wording."""
        made = object.__new__(cls)
        made._value_, made.words, made.badge = value, words or value, badge
        return made


class Judgement(Worded):
    """Whether runs meet the target; `study.json` contains the value.

    Examples
    --------
    >>> Judgement.PROBABLY_MET.words, Judgement.PROBABLY_MET.badge
    ('probably good enough', 'fit')
    """

    MET = "met", "good enough", "yes"
    PROBABLY_MET = "probably_met", "probably good enough", "fit"
    PROBABLY_MISSED = "probably_missed", "probably not good enough", "fit"
    MISSED = "missed", "not good enough", "no"

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


class Effect(Worded):
    """Effect of a remedy on the error; `study.json` contains the value."""

    HELPS = "helps", "helps", "yes"
    UNCERTAIN = "uncertain", "not sure", "fit"
    HARMS = "harms", "makes it worse", "no"

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


class NotOk(Worded):
    """Reason for a state other than ``ok``; `study.json` contains the value."""

    LEVEL = "level", "level above the alert limit"
    SUSPECTED = "suspected", "suspected fault"
    CONTRADICTED = "contradicted", "position lost"


class Cause(Enum):
    """Cause of an unavailable position.

    Attributes
    ----------
    remedy
        Measures against the cause.
    """

    remedy: str
    _words: str

    def __new__(cls, value: str, words: str = "", remedy: str = "") -> Self:
        """Creates a member; ``words`` may contain the alert limit."""
        made = object.__new__(cls)
        made._value_, made._words, made.remedy = value, words, remedy
        return made

    SEARCHING = (
        "searching",
        "first position not found yet",
        "a start pose, or more radio heads near the start",
    )
    CONTRADICTED = (
        "contradicted",
        "contradictions between radio heads, array and odometer",
        "a survey of radio heads and array mounting (access-av record survey)",
    )
    TOO_WIDE = (
        "too_wide",
        "protection level above the alert limit of {limit_m:g} m",
        "more wake-ups, more radio heads, smaller standard deviations, or a higher "
        "integrity.alert_limit_m if the plant permits it",
    )
    SUSPECTED = (
        "suspected",
        "fault of a radio head, the array or the odometer suspected, now or recently",
        "realistic standard deviations of array, odometer and radio heads, because errors within "
        "them are not faults",
    )

    def words(self, alert_limit_m: float) -> str:
        """Returns the wording for reports, with the alert limit of the vehicle in metres.

        Examples
        --------
        >>> Cause.TOO_WIDE.words(1.5)
        'protection level above the alert limit of 1.5 m'
        """
        return self._words.format(limit_m=alert_limit_m)


class LevelResult(Worded):
    """Whether runs reach a 3GPP positioning service level; the value is the wording."""

    REACHED = "reached", "", "yes"
    TOO_FEW_RUNS = "too few runs", "", "fit"
    NOT_REACHED = "not reached", "", "no"
