"""The onboard computer: its platform file, and its time and energy (``access-av design profile``).

``counters`` finds the power sensors, ``energy`` converts their values to intervals, ``power_modes``
switches the board, ``workload`` contains the timed code, and ``profile`` combines them and writes
the platform file.
"""
