"""Columns of all written and returned tables: one name for one quantity.

:data:`GLOSSARY` contains unit and meaning of each name; :data:`TABLES` contains the names of each
table and the conditions of null values. Tables have no other columns and no NaN.
``docs/columns.md`` is generated from both, and tests compare them with the produced tables.

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
