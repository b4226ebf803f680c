"""Verdicts of a study, and their wording."""

from __future__ import annotations

from enum import Enum


class Judgement(Enum):
    """Whether drives meet the target; the value stands in `study.json`."""

    MET = "met"
    PROBABLY_MET = "probably_met"
    PROBABLY_MISSED = "probably_missed"
    MISSED = "missed"

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
    """Effect of a remedy on the error; the value stands in `study.json`."""

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
        """Effect by a difference to the baseline and the ends of its 95 % interval.

        Examples
        --------
        >>> Effect.of((-0.2, -0.3, -0.1)), Effect.of((0.1, -0.1, 0.3))
        (<Effect.HELPS: 'helps'>, <Effect.UNCERTAIN: 'uncertain'>)
        """
        _, low, high = delta_m
        if high < 0.0:
            return cls.HELPS
        return cls.HARMS if low > 0.0 else cls.UNCERTAIN


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
