"""Errors that the user can correct."""


class InputError(ValueError):
    """Invalid input; the message contains its name and the allowed values."""


class ImplausibleSettingsWarning(UserWarning):
    """Valid settings whose combination is implausible; the message contains key and remedy."""
