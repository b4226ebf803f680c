"""The radio of a site: channels, ray-traced paths, where radio heads stand and what would help."""
