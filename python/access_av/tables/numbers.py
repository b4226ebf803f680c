"""Numbers as text for reports."""

from __future__ import annotations

from typing import Any


def number(value: float | None, digits: int = 3) -> str:
    """Returns a number as text; a dash for ``None``."""
    return "–" if value is None else unsigned_zero(f"{value:,.{digits}f}")


def unsigned_zero(text: str) -> str:
    """Removes the sign of a number's text that contains only zeros.

    Examples
    --------
    >>> unsigned_zero("-0.00"), unsigned_zero("-0.01")
    ('0.00', '-0.01')
    """
    return text if set(text) - set("+-0.,") else text.lstrip("+-")


def count(number: int | str, what: str) -> str:
    """Returns a number with its noun.

    Examples
    --------
    >>> count(1, "wall"), count(2, "wall")
    ('1 wall', '2 walls')
    """
    return f"{number} {what}{'' if number == 1 else 's'}"


def value_text(value: Any) -> str:
    """Returns a value of a claim (number, list or table) as text."""
    if value is None:
        return "none"
    if isinstance(value, dict):
        return ", ".join(
            f"{key.replace('_', ' ')} {value_text(item)}" for key, item in value.items()
        )
    if isinstance(value, list):
        return ", ".join(map(value_text, value)) or "none"
    if isinstance(value, (int, float)):
        return f"{value:,.0f}" if abs(value) >= 1000 else unsigned_zero(f"{value:.4g}")
    return str(value)
