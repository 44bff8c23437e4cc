"""Options of one concern as a class, which a command takes as one argument.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class RestOptions(Options):
        still: Annotated[str | None, typer.Option(metavar="TIME", help="Least rest.")] = None

    def spin_command(log: LogArgument, rest: RestOptions) -> None: ...

Typer sees an option for each field, where the argument stands; the command gets a `RestOptions`.
"""

from __future__ import annotations

import functools
import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, fields
from inspect import Parameter
from typing import Any, get_type_hints

from tumble.foundation.errors import ProcedureError


class Options:
    """Base of frozen data classes whose fields are options, annotated with what typer makes of each."""

    __slots__ = ()


class OptionsAround(Options, ABC):
    """Options of what is done around a command, which itself knows nothing of them."""

    __slots__ = ()

    @abstractmethod
    def run(self, command: Callable[[], None]) -> None:
        """Run the command."""


def expanded(command: Callable[..., None], around: type[OptionsAround] | None = None) -> Callable[..., None]:
    """Give a command an option for each field of the `Options` that it takes, and of those around it."""
    hints = get_type_hints(command, include_extras=True)
    kinds = {name: hint for name, hint in hints.items() if _is_a_kind_of_options(hint)}
    signature = inspect.signature(command)
    parameters: list[Parameter] = []
    for name, parameter in signature.parameters.items():
        if name in kinds:
            parameters += _parameters_of(kinds[name])
        else:
            parameters.append(parameter.replace(annotation=hints[name], kind=Parameter.KEYWORD_ONLY))
    parameters += _parameters_of(around) if around else ()

    @functools.wraps(command)
    def wrapper(**typed: Any) -> None:  # noqa: ANN401
        options = {name: _taken(kind, typed) for name, kind in kinds.items()}
        surrounding = _taken(around, typed) if around else None
        if surrounding is None:
            command(**typed, **options)
        else:
            surrounding.run(functools.partial(command, **typed, **options))

    wrapper.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    wrapper.__annotations__ = {each.name: each.annotation for each in parameters} | {"return": None}
    return wrapper


def refuse_given(options: Mapping[str, object], why: str) -> None:
    """Raise `ProcedureError` for the first option that was given and has no meaning here."""
    for option, value in options.items():
        if value:
            raise ProcedureError(f"{option} {why}")


def _is_a_kind_of_options(hint: object) -> bool:
    return isinstance(hint, type) and issubclass(hint, Options)


def _taken(kind: Any, typed: dict[str, Any]) -> Any:  # noqa: ANN401 - a data class
    """Take the fields of a kind of options out of what was typed."""
    return kind(**{field.name: typed.pop(field.name) for field in fields(kind)})


def _parameters_of(kind: Any) -> Iterator[Parameter]:  # noqa: ANN401 - a data class
    hints = get_type_hints(kind, include_extras=True)
    for field in fields(kind):
        default = Parameter.empty if field.default is MISSING else field.default
        yield Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=hints[field.name])
