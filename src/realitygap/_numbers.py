"""Numbers as texts for people."""

from __future__ import annotations


def significant(value: float, digits: int, *, keep_zeros: bool = False) -> str:
    """Return a number with some significant digits; from 1,000 on without an exponent, and with commas.

    Args:
        value: The number.
        digits: Number of significant digits.
        keep_zeros: True to show zeros at the end, so that numbers of a column are equally exact.
    """
    rounded = float(f"{value:.{digits}g}")
    if abs(rounded) >= min(1000.0, 10.0**digits):
        return f"{rounded:,.0f}" if abs(rounded) < 1e15 else f"{value:.{digits}g}"
    text = f"{value:{'#' if keep_zeros else ''}.{digits}g}"
    return text.removesuffix(".")


def fixed(value: float, digits: int) -> str:
    """Return a number with some digits after the point; from a billion on with an exponent, so that it stays short."""
    return f"{value:.{digits}f}" if abs(value) < 1e9 else f"{value:.4g}"
