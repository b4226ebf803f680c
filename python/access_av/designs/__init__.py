"""Designs of a scenario: what can be varied, driven, and compared; ``access-av designs``.

``space`` says what may be chosen, ``driven`` drives each choice, ``front`` compares them, and
``search`` decides which are driven how often; ``suggested`` leaves that to Optuna.
"""
