"""Looks at one part after the other; where looking fails, that is what is found of it."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib import import_module, metadata
from pathlib import Path

from tumble.foundation.file_status import home_folder
from tumble.logs.optional import EXTRAS, install_command
from tumble.tools.doctor.devices import iio_devices, serial_ports
from tumble.tools.doctor.libraries import PACKAGE, Requirement, library, requirements
from tumble.tools.doctor.project import project
from tumble.tools.doctor.result import Diagnosed, Diagnosis, DiagnosisSection, State
from tumble.tools.doctor.terminal import terminal

INSTALL_AGAIN = f"python -m pip install --force-reinstall {PACKAGE}"
DATA_FRAMES = Requirement("pandas", "", "")
"""Library for results as data frames; it comes with no extra."""


def diagnose(root: Path = Path("/"), home: Path | None = None) -> Diagnosis:
    """Inspects this machine: devices below `root`, what a shell completes below `home`, that of the user."""
    return Diagnosis(
        (
            _section("Tumble", _tumble, is_needed=True),
            _section("Libraries", partial(_libraries, "", INSTALL_AGAIN), is_needed=True),
            *(
                _section(f"Extra {extra}: {what}", partial(_libraries, extra, install_command(extra)))
                for extra, what in EXTRAS.items()
            ),
            _section("Data frames", lambda: [library(DATA_FRAMES, "python -m pip install pandas")]),
            _section("Serial ports", partial(serial_ports, root)),
            _section("Sensors of Linux (IIO)", partial(iio_devices, root)),
            _section("Settings", partial(project, home)),
            _section("Terminal", partial(terminal, home or home_folder())),
        )
    )


def _section(
    name: str, look: Callable[[], Iterable[Diagnosed]], *, is_needed: bool = False
) -> DiagnosisSection:
    found: list[Diagnosed] = []
    try:
        found.extend(look())
    except Exception as error:
        what = f"{type(error).__name__}: {' '.join(str(error).split())}"
        found.append(Diagnosed(name, State.BROKEN, what, INSTALL_AGAIN))
    return DiagnosisSection(name, tuple(found), is_needed)


def _tumble() -> Iterator[Diagnosed]:
    """Inspects the package and its native module, which is to be of the same version."""
    wanted = metadata.version(PACKAGE)
    yield Diagnosed("tumble", State.WORKS, wanted)
    system = f"{platform.system()} {platform.machine()}"
    yield Diagnosed("Python", State.WORKS, f"{platform.python_version()} on {system}")
    core = import_module("tumble._core")
    if core.__version__ == wanted:
        yield Diagnosed("native module", State.WORKS, f"{wanted}, {core.__file__}")
    else:
        what = f"{core.__version__}, while the package is {wanted}"
        yield Diagnosed("native module", State.BROKEN, what, INSTALL_AGAIN)


def _libraries(extra: str, remedy: str) -> Iterator[Diagnosed]:
    for requirement in requirements():
        if requirement.extra == extra:
            yield library(requirement, remedy)
