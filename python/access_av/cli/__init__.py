"""The command line: commands, a file per concern, and what they show; ``main`` joins them."""
