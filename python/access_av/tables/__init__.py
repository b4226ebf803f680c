"""Tables and files: their columns, whether a given one can be used, where results are written."""
