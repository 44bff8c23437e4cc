"""Stations of a laboratory that write into one registry at once: each a process that a test may kill."""

from __future__ import annotations

import multiprocessing

_CONTEXT = multiprocessing.get_context("forkserver")
"""Forks of a process that has imported a registry and opened none: a start of Python takes 0.5 s."""
_CONTEXT.set_forkserver_preload(["tumble.laboratory.registry", "tumble.laboratory.certificate.record"])


class Station:
    """A process that runs `work(say, *arguments)`; a test reads the texts that it says."""

    def __init__(self, work, *arguments):
        self._heard, said = _CONTEXT.Pipe(duplex=False)
        self._process = _CONTEXT.Process(target=_run, args=(said, work, arguments))
        self._process.start()
        # Its end of the pipe is the only one, so that the pipe ends with it.
        said.close()

    def hear(self):
        """Waits for its next text; none comes after its end, nor of one that a kill cut short."""
        try:
            return self._heard.recv_bytes().decode()
        except (EOFError, OSError):
            return None

    def hear_all(self):
        """Waits for its end; returns all texts that were not heard before."""
        heard = list(iter(self.hear, None))
        self._process.join()
        return heard

    def kill(self):
        """Kills it, between any two instructions."""
        self._process.kill()

    @property
    def exit_code(self):
        """Exit code of a station that has ended."""
        return self._process.exitcode


def _run(said, work, arguments):
    work(lambda text: said.send_bytes(text.encode()), *arguments)
