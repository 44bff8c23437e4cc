"""Names of the files that results are written to: no procedure writes over what another one wrote.

The turntable names the files of a target after it: `drive.yaml`. Others put their own name behind that of the
unit: `drive.spin.yaml`. No target is given a name that is taken below, or that ends like that.
"""

from __future__ import annotations

import re

from tumble.foundation.procedures import PROCEDURES

TURNTABLE_PAGE = "turntable.html"
SUMMARY = "summary.csv"
ATTEMPTS = "batch.jsonl"
EARLIER = "earlier"
"""Folder of what earlier attempts left and the last one did not replace."""
REDUNDANCY_PAGE = "redundancy.html"
EVENTS = "events.jsonl"
STORE = "store"
SESSION_FOLDER = "session"
"""Name of the recording of a live session in the folder of its results."""
SESSION_FILE = "session.yaml"
"""File that marks a folder as a recorded session."""
AIDING_FILE = "aiding.csv"
"""Aiding measurements that were recorded with a session."""
ALIGN_PAGE = "align.html"
ALIGN_SETTINGS = "align.yaml"
COMPARE_PAGE = "compare.html"

PLATEAUS = "plateaus"
"""Behind the name of a unit whose calibrations over temperature were put together."""

_OF_UNITS = (*(ending for procedure in PROCEDURES for ending in procedure.endings), PLATEAUS)

TAKEN = frozenset((*_OF_UNITS, *(name for procedure in PROCEDURES for name in procedure.files), "compare"))
"""Names of files, without their endings, that no target may bear."""


_LONGEST = 160
"""Bytes of a name; endings and numbers are put behind it, and a file system takes 255."""
_KEPT = 140
"""Bytes that are kept of a longer one."""


def file_stem(name: str) -> str:
    """Returns a name for a file or folder from any text: one part of a path, never one above its folder.

    The ending of a procedure becomes part of the name. A long text is cut, with a digest of all of it, so
    that two of them differ. A name that this returned comes back as it is.
    """
    stem = re.sub(r"[^\w.+-]+", "_", name.strip("/")).lstrip(".") or "unit"
    stem = re.sub(rf"\.(?=({'|'.join(_OF_UNITS)})$)", "_", stem)
    whole = stem.encode()
    if len(whole) <= _LONGEST:
        return stem
    import hashlib  # brings a library of the system, for which all commands would wait

    return f"{whole[:_KEPT].decode(errors='ignore')}-{hashlib.sha256(whole).hexdigest()[:12]}"


def unit_stem(name: str, ending: str) -> str:
    """Names the files of a unit, without extension: `drive.spin`, but `spin` for a log of that name.

    `ending` is one of a procedure's.
    """
    assert ending in _OF_UNITS, ending
    stem = file_stem(name)
    return stem if stem == ending else f"{stem}.{ending}"
