"""The columns of every table that is written or returned: one name for one quantity.

:data:`GLOSSARY` says once what a name means; :data:`TABLES` says which names a table has and when a
value is null. Nothing else is in a table, and no value is NaN. ``docs/columns.md`` is made from
this, and tests hold what is really produced to it.

Examples
--------
>>> from access_av import columns
>>> columns.TABLES["aoa_estimates"].null["angle_rad"]
'no angle could be estimated'
>>> columns.GLOSSARY["covariance_xy_m2"].unit
'm²'
"""

from __future__ import annotations

from access_av.tables.columns.glossary import GLOSSARY, Column
from access_av.tables.columns.look_up import as_json, markdown, table
from access_av.tables.columns.tables import TABLES, Table

__all__ = ["GLOSSARY", "TABLES", "Column", "Table", "as_json", "markdown", "table"]
