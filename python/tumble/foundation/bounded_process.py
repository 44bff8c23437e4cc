"""A bound of time for a library that Python cannot interrupt in a file of others: a process of its own."""

from __future__ import annotations

import os
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, TypeVar, cast

from tumble.foundation import clock
from tumble.foundation.workers import WorkerContext, begin

Result = TypeVar("Result")
_STANDARD_ERROR = 2


def in_bounded_process(work: Callable[..., Result], *arguments: object, seconds: float) -> Result:
    """Returns what `work` does in a process of its own; work and arguments are such as can be pickled.

    Raises `TimeoutError` where it takes more than so many s, `EOFError` where the process ends without an
    answer, as for want of memory, and what the work raises. The process is gone in any case.
    """
    context = WorkerContext()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(sender, work, arguments), daemon=True)
    answers: list[Any] = []
    listener = clock.thread(_listen, receiver, answers, name="bounded process")
    try:
        process.start()
        # The end of the process is then the end of what it sends.
        sender.close()
        listener.start()
        if not clock.wait(listener, seconds):
            raise TimeoutError(f"takes more than {seconds:g} s")
    finally:
        process.kill()
        process.join()
        clock.wait(listener)
        receiver.close()
    if not answers:
        raise EOFError("ends without an answer")
    if isinstance(answers[0], Exception):
        raise answers[0]
    return cast("Result", answers[0])


def _answer(sender: Connection, work: Callable[..., object], arguments: tuple[object, ...]) -> None:
    begin()
    # A library that ends for a defect of its own would print on it; nobody reads that.
    reader, writer = os.pipe()
    os.close(reader)
    os.dup2(writer, _STANDARD_ERROR)
    try:
        answer = work(*arguments)
    except Exception as error:  # raised again where the work was asked for
        answer = error
    sender.send(answer)


def _listen(receiver: Connection, answers: list[Any]) -> None:
    try:
        answers.append(receiver.recv())
    except (EOFError, OSError):
        return
