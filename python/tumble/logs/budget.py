"""Budget of memory and of temporary files for what a log unpacks to, before its samples are looked at."""

from __future__ import annotations

_TIMES = 10
"""Bytes for each byte of the file: readings hardly become a third by packing."""
_LEAST = 128 << 20
"""Bytes for the smallest file: chunks and buffers of libraries have sizes of their own."""
_LARGEST = 1 << 30


def memory_budget(size: int) -> int:
    """Returns how many bytes a file of that size may take in memory before its samples are read."""
    return min(max(_LEAST, _TIMES * size), _LARGEST)


def unpacked_budget(size: int) -> int:
    """Returns how many bytes a file of that size may unpack to on disk."""
    return max(_LEAST, _TIMES * size)
