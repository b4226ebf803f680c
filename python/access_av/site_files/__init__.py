"""Import and export of roads, radio heads and walls: CSV, GeoJSON, DXF."""
