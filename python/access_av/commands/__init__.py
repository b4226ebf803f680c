"""The command line's commands, a file per concern; ``access_av.cli`` puts them together."""
