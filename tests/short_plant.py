"""Plant with a road of 35 m, on which a study takes seconds."""

from __future__ import annotations

import re

# Names contain markup, to test that pages show it as text.
PLANT = """
name = "short"
target = "0.2 m 90 %"
vehicle = "tugger"
[site]
name = "short"
[site.road]
segments = [
  { length_m = 20.0 }, { radius_m = 6.0, turn_rad = 1.5707963267948966 }, { length_m = 6.0 },
]
[[site.radio_heads]]
name = "a <b>bold</b> mast"
position_m = [10.0, 20.0, 8.0]
position_std_m = 0.1
pci = 1
eirp_dbm = 10.0
[[site.radio_heads]]
name = "other"
position_m = [60.0, 10.0, 8.0]
position_std_m = 0.1
pci = 2
ssb_index = 1
eirp_dbm = 10.0
[motion]
stops = [{ name = "dock <i>", at_m = 12.0, dwell_s = 1.0 }]
[[targets]]
name = "gate <i>"
at_m = 28.0
target = "0.1 m 90 %"
[[targets]]
from_m = 3.0
to_m = 12.0
target = "2 m 95 %"
[fleet]
vehicles = 6
hours_per_day = 16.0
trips_per_day = 40
years = 4.0
[prices]
currency = "EUR"
lidar = 3000.0
survey = { low = 10.0, value = 20.0, high = 40.0, source = "offer of <i>somebody</i>" }
"""
# Its last 5 m without targets of stretches, for tests that do not depend on the results.
LAST_METRES = re.sub(
    r"stops = .*?(?=\[fleet\])", "start_at_m = 30.0\n", PLANT, count=1, flags=re.DOTALL
)
