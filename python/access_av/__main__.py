"""``python -m access_av`` is ``access-av``."""

from access_av.cli import main

main()
