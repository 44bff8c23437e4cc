"""Scene of the demo: five targets of different grades beside a reference, one of them faulty."""

from __future__ import annotations

from pathlib import Path

from tumble.foundation.documents import document_kind
from tumble.foundation.file_reading import own_text
from tumble.foundation.files import prepare_folder, refuse_linked_folder, write_text

GRADES = ("consumer", "consumer", "industrial", "tactical", "industrial")
TARGETS = tuple(f"target_{number}" for number in range(1, len(GRADES) + 1))
"""Names of the targets in the simulator."""
FAULTY = "target_5"
"""One of its axes reads 10 % too much, so that it fails its limits."""
SEED = "7"
SESSION = "session"
LIMITS = "limits.yaml"


def simulating(folder: Path) -> list[str]:
    """Returns what follows `tumble` to make the session, in a folder of its own; raises `OutputError`."""
    refuse_linked_folder(folder / SESSION)
    fault = f"{FAULTY}:scale:axis=y:size=1.1"
    scene = ["--grades", ",".join(GRADES), "--fault", fault, "--clocks", "apart", "--seed", SEED]
    return ["simulate", "turntable", *scene, "-o", str(folder / SESSION)]


def calibrating(folder: Path) -> list[str]:
    """Returns what follows `tumble` to calibrate the targets of the session."""
    session = folder / SESSION
    recordings = [str(session / f"{name}.csv") for name in ("reference", *TARGETS)]
    options = ["--poses", str(session / "poses.yaml"), "--limits", str(folder / LIMITS), "--g-sensitivity"]
    return ["turntable", *recordings, *options, "-o", str(folder)]


def write_limits(folder: Path) -> None:
    """Puts the limits beside the results; raises `OutputError` where the folder cannot be written to."""
    text = own_text(Path(__file__).with_name(LIMITS))
    write_text(prepare_folder(folder) / LIMITS, text, document_kind("tumble-limits/1"))
