"""Authority to change what all pages of a bench share: whoever asks is known, and by default nobody may.

`Gate` states the browser behind each request and each message, threads of the bench state the bench itself.
An object of shared state, a subclass of `Shared`, looks who acts before each change, whichever button, field
or route leads to it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from types import FunctionType
from typing import Any, ParamSpec, TypeVar

from tumble.foundation.errors import TumbleError

Allowed = Callable[[], bool]
"""Returns whether the one who acts may change the bench now."""
Given = ParamSpec("Given")
Answer = TypeVar("Answer")


def _nobody() -> bool:
    return False


_allowed: ContextVar[Allowed] = ContextVar("allowed", default=_nobody)


class NotOperatorError(TumbleError):
    """Somebody else than the operator wants to change the bench."""

    def __init__(self) -> None:
        super().__init__("Another browser holds the bench; ask for it first.")


@contextmanager
def acting(allowed: Allowed) -> Iterator[None]:
    """States who acts while the block runs, and in the tasks that it begins."""
    before = _allowed.set(allowed)
    try:
        yield
    finally:
        _allowed.reset(before)


def as_bench(function: Callable[Given, Answer]) -> Callable[Given, Answer]:
    """Has a function act as the bench itself, for its threads, its start and its end."""

    @wraps(function)
    def act(*arguments: Given.args, **named: Given.kwargs) -> Answer:
        with acting(lambda: True):
            return function(*arguments, **named)

    act.is_query = True  # type: ignore[attr-defined]
    return act


def query(function: Callable[Given, Answer]) -> Callable[Given, Answer]:
    """Marks a method that changes nothing, so that everybody may call it."""
    function.is_query = True  # type: ignore[attr-defined]
    return function


def is_allowed() -> bool:
    """Returns whether the one who acts may change the bench."""
    return _allowed.get()()


def refuse_unless_allowed() -> None:
    """Raises `NotOperatorError` where the one who acts may not change the bench."""
    if not is_allowed():
        raise NotOperatorError


class Shared:
    """State that pages share: who may not change it writes nothing, and calls nothing but a `query`."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        for name, member in list(vars(cls).items()):
            is_method = isinstance(member, FunctionType) and not name.startswith("_")
            if is_method and not hasattr(member, "is_query"):
                setattr(cls, name, _guarded(member))

    def __setattr__(self, name: str, value: object) -> None:
        refuse_unless_allowed()
        super().__setattr__(name, value)


def _guarded(method: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(method)
    def asked(*arguments: object, **named: object) -> object:
        refuse_unless_allowed()
        return method(*arguments, **named)

    return asked
