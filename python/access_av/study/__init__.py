"""A plant's question answered: is it good enough here, where not, what mends it, what it costs."""

from access_av.study.answer import Study, study_plant

__all__ = ["Study", "study_plant"]
