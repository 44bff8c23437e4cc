"""Has typst set a document."""

from __future__ import annotations

from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import typst

from tumble.foundation.bounded_process import in_bounded_process
from tumble.foundation.errors import TumbleError

STANDARD: Final = "a-3b"
SET_WITHIN: Final = 30.0
"""s within which a document is set that shows what others drew: a hundred times of what one takes."""


class TypesettingError(TumbleError):
    """A document that typst cannot set."""


def set_pdf(path: Path, inputs: dict[str, str], moment: datetime) -> bytes:
    """Return the PDF/A of a template with its inputs.

    Raises `TypesettingError` where typst cannot set it, and `TumbleError` where there is no template.
    """
    try:
        found = typst.compile(
            str(path),
            root=str(path.parent),
            font_paths=fonts(),
            sys_inputs=inputs,
            format="pdf",
            pdf_standards=[STANDARD],
            timestamp=moment,
        )
    except typst.TypstError as error:
        raise TypesettingError(" ".join(str(getattr(error, "message", error)).split())) from error
    except (RuntimeError, OSError) as error:  # of typst too: the template is no file, or in no folder
        raise TumbleError(f"{path}: cannot be read: {error}; check the path") from error
    assert isinstance(found, bytes)
    return found


def set_pdf_in_time(path: Path, inputs: dict[str, str], moment: datetime) -> bytes:
    """Return the same of a template or picture of others, which may go on for ever.

    Raises `TimeoutError` then, and `EOFError` where typst ends for it.
    """
    return in_bounded_process(set_pdf, path, inputs, moment, seconds=SET_WITHIN)


@lru_cache(maxsize=1)
def fonts() -> Any:  # noqa: ANN401 - typst has no public type for them
    """Search for fonts once; that takes as long as the rest."""
    return typst.Fonts()
