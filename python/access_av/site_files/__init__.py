"""Roads, radio heads and walls from the files that plants have, and back: CSV, GeoJSON, DXF."""
