"""Plant with a road of 30 m, on which a study takes seconds."""

from __future__ import annotations

PLANT = """
name = "short"
target = "0.2 m 90 %"
vehicle = "tugger"
[site]
name = "short"
[site.road]
polyline_m = [[0.0, 0.0], [30.0, 0.0]]
[[site.radio_heads]]
name = "mast"
position_m = [10.0, 20.0, 8.0]
pci = 1
eirp_dbm = 10.0
[[site.radio_heads]]
name = "other"
position_m = [60.0, 10.0, 8.0]
pci = 2
eirp_dbm = 10.0
[fleet]
vehicles = 6
hours_per_day = 16.0
trips_per_day = 40
years = 4.0
[prices]
currency = "EUR"
"""
