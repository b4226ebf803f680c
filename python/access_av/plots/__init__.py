"""Charts of results, for notebooks."""
