"""The report of the evaluation, a file per section."""
