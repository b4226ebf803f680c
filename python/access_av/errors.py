"""Errors the user can put right."""


class InputError(ValueError):
    """An input that cannot be used; the message says which, and what is allowed."""


class ImplausibleSettingsWarning(UserWarning):
    """Settings that are valid but not meant for each other; the message names key and remedy."""
