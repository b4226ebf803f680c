"""Plant study: accuracy verdict, positions with large errors, remedies and costs."""

from access_av.study.answer import study_plant
from access_av.study.study_result import Study

__all__ = ["Study", "study_plant"]
