"""The computer on board: its platform file, and its time and energy (``access-av profile``).

``counters`` finds the power sensors, ``energy`` turns what they say into intervals, ``power_modes``
switches the board, ``workload`` is what is timed, ``profile`` puts them together and writes the
platform file.
"""
