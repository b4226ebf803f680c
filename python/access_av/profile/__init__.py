"""Time and energy of the computation on the device it runs on; ``access-av profile``.

``counters`` finds the power sensors, ``energy`` turns what they say into intervals, ``power_modes``
switches the board, ``workload`` is what is timed, ``device`` puts them together and writes the
platform file.
"""
