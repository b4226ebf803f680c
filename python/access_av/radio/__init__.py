"""Radio of a site: channels, ray-traced paths, placement of radio heads, improvements."""
