"""Reports as HTML files that load nothing: pages of a drive, a located drive, a bound."""
