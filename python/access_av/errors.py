"""Errors the user can put right."""


class InputError(ValueError):
    """An input that cannot be used; the message says which, and what is allowed."""
