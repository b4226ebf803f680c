"""A plant's question answered: is it good enough here, where not, what mends it, what it costs."""

from access_av.study.answer import study_plant
from access_av.study.study_result import Study

__all__ = ["Study", "study_plant"]
