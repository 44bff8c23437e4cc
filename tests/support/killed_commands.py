"""Commands on a simulated bench that are killed, each in a process of its own, at a moment of its clock."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys

from live_benches import simulated_bench, words_of
from tumble.foundation import clock
from tumble.tools.record.writer import FLUSH_EVERY
from typed_commands import typed


def killed_on_bench(words, after, operations=0, **bench):
    """Runs a command until so many s have passed, and so many operations on files since; returns the time, s.

    `{units}` among the words are all units of the bench, `{unit}` is the address of the first, `{table}` that
    of its table. `bench` is as for `simulated_bench`. A command that ends before is killed at its end.
    """
    given = {"words": list(map(str, words)), "after": after, "operations": operations, "bench": bench}
    done = subprocess.run(
        [sys.executable, __file__, json.dumps(given, default=str)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == -signal.SIGKILL, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return float(done.stdout.splitlines()[-1])


def filled(words, bench):
    """The words with what stands for units and table of a bench filled in."""
    for word in words:
        if word == "{units}":
            yield from words_of(bench)
        else:
            yield (
                str(word)
                .replace("{unit}", next(iter(bench.addresses.values())))
                .replace("{table}", str(bench.table_address))
            )


def _kill():
    # Prints of the command go elsewhere.
    os.write(1, f"{clock.now()}\n".encode())
    os.kill(os.getpid(), signal.SIGKILL)


def _kill_later(after, operations):
    clock.sleep(after)
    left = iter(range(operations))

    def count(event, _):
        if event in ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir") and next(left, None) is None:
            _kill()

    sys.addaudithook(count) if operations else _kill()


def main():
    given = json.loads(sys.argv[1])
    with simulated_bench(**given["bench"], flush=FLUSH_EVERY) as bench:
        clock.thread(_kill_later, given["after"], given["operations"], name="killer").start()
        typed(*filled(given["words"], bench))
        _kill()


if __name__ == "__main__":
    main()
