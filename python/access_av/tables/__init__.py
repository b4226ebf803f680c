"""Tables and files: columns, validation of given tables, results on disk."""
