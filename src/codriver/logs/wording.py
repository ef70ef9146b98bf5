"""Counts in the sentences on faults."""

from __future__ import annotations


def counted(count: int, noun: str, singular: str = "", plural: str = "") -> str:
    """A number of things, and what they do: counted(1, "row", "is", "are") is "1 row is".

    Args:
        count: how many.
        noun: what, in the singular; its plural has an s.
        singular, plural: the verb that goes with each.
    """
    one = count == 1
    return " ".join(filter(None, (f"{count} {noun}{'' if one else 's'}", singular if one else plural)))
