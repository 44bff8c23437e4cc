"""Options that say who makes a result and where, which its page and its files carry."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, TypeAlias, get_type_hints

import typer

OperatorOption: TypeAlias = Annotated[
    str, typer.Option(envvar="TUMBLE_OPERATOR", metavar="NAME", help="Who calibrates.", show_default=False)
]
StationOption: TypeAlias = Annotated[
    str, typer.Option(envvar="TUMBLE_STATION", metavar="NAME", help="Where that is done.", show_default=False)
]
_OPTIONS = {"operator": OperatorOption, "station": StationOption}


def with_maker(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command `--operator` and `--station`, which results that it finds keep."""
    signature = inspect.signature(command)
    hints = get_type_hints(command, include_extras=True)
    own = [
        parameter.replace(annotation=hints.get(name, parameter.annotation), kind=parameter.KEYWORD_ONLY)
        for name, parameter in signature.parameters.items()
    ]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default="", annotation=annotation)
        for name, annotation in _OPTIONS.items()
    ]

    @functools.wraps(command)
    def wrapper(**arguments: Any) -> None:  # noqa: ANN401
        from tumble.foundation.provenance import made_by

        with made_by(*(arguments.pop(name) for name in _OPTIONS)):
            command(**arguments)

    wrapper.__signature__ = signature.replace(parameters=[*own, *added])  # type: ignore[attr-defined]
    wrapper.__annotations__ = {p.name: p.annotation for p in (*own, *added)} | {"return": None}
    return wrapper
