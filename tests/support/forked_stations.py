"""Stations of a laboratory that write into one registry at once: each a process that a test may kill."""

from __future__ import annotations

import multiprocessing

_CONTEXT = multiprocessing.get_context("forkserver")
"""Forks of a process that has imported a registry and opened none: a start of Python takes 0.5 s."""
_CONTEXT.set_forkserver_preload(["tumble.laboratory.registry", "tumble.laboratory.certificate.record"])


class Station:
    """A process that runs `work(report, *arguments)`; a test reads the texts that it reports."""

    def __init__(self, work, *arguments):
        self._receiver, sender = _CONTEXT.Pipe(duplex=False)
        self._process = _CONTEXT.Process(target=_run, args=(sender, work, arguments))
        self._process.start()
        # Its end of the pipe is the only one, so that the pipe ends with it.
        sender.close()

    def receive(self):
        """Waits for its next text; none comes after its end, nor of one that a kill cut short."""
        try:
            return self._receiver.recv_bytes().decode()
        except (EOFError, OSError):
            return None

    def receive_all(self):
        """Waits for its end; returns all texts that were not received before."""
        received = list(iter(self.receive, None))
        self._process.join()
        return received

    def kill(self):
        """Kills it, between any two instructions."""
        self._process.kill()

    @property
    def exit_code(self):
        """Exit code of a station that has ended."""
        return self._process.exitcode


def _run(sender, work, arguments):
    work(lambda text: sender.send_bytes(text.encode()), *arguments)
