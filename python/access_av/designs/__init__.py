"""Designs of a scenario: variation, simulation and comparison (``access-av design sweep``).

``space`` defines the designs, ``driven`` simulates each of them, ``front`` compares them, and
``search`` selects the number of runs of each; ``suggested`` uses Optuna for this.
"""
