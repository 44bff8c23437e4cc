"""A recorded session to files, as the command does with `SESSION`, for programs without a command line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from tumble.foundation.errors import ProcedureError
from tumble.foundation.files import prepare_folder
from tumble.logs.options import ReadOptions
from tumble.logs.session import unit_names
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.procedures.turntable.batch import Batch
from tumble.procedures.turntable.command_run import TurntableRun
from tumble.procedures.turntable.procedure import TurntableSession
from tumble.procedures.turntable.production import Production, key_of_run, pages_for
from tumble.procedures.turntable.session_poses import poses_of
from tumble.procedures.turntable.targets import find_targets

JOBS = 2
"""Targets that are read at once, beside a page that goes on being served."""


def calibrate_session(
    session: Path,
    reference: str,
    folder: Path,
    *,
    open_reference: Callable[..., TurntableSession],
    not_shown: Sequence[str] = (),
    latitude: float | None = None,
) -> tuple[TurntableRun, dict[str, Path]]:
    """Calibrates all targets of a session, and writes their files into `folder`.

    `open_reference` is `open_session` with all but the recording, its poses and options of reading;
    `not_shown` are names of poses of which nothing was recorded. Returns the run and the files that its
    targets share.

    Raises `TumbleError` where nothing can be done; files of earlier runs stay then.
    """
    source, targets = _units(session, reference)
    poses, read = _poses(session, not_shown), ReadOptions()
    found = find_targets(
        targets, source, poses=poses.files() if poses else (), output=folder, read=lambda _: read
    )
    batch = Batch(prepare_folder(folder))
    fitted = open_reference(source, poses=poses, read=read)
    key = key_of_run(fitted, poses, read, latitude)
    pages = pages_for(len(found.targets))
    production = Production(fitted, batch, pages, lambda _: read, key, JOBS, resume=False)
    run = TurntableRun(production, len(found.targets), everything=True, as_json=False)
    for made in production.run(found.targets):
        run.add(made)
    return run, run.save(folder)


def _units(session: Path, reference: str) -> tuple[str, list[str]]:
    names = unit_names(str(session))
    if reference not in names:
        raise ProcedureError(f"{session}: no unit {reference!r}; it holds {', '.join(names)}")
    return f"{session}:{reference}", [f"{session}:{name}" for name in names if name != reference]


def _poses(session: Path, not_shown: Sequence[str]) -> PoseList | None:
    poses = poses_of(session) or SIX_FACES
    return poses if poses is SIX_FACES else poses.without(not_shown)
