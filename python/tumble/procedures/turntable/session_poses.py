"""The pose list that a recorded session brings: what was asked of the table while it was recorded."""

from __future__ import annotations

from pathlib import Path

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import exists, is_file, is_folder
from tumble.foundation.recording import Recording, RecordingSource
from tumble.logs import parse_spec
from tumble.poses.pose_list import SIX_FACES, PoseList

FILE = "poses.yaml"


def poses_of(session: Path | str) -> PoseList | None:
    """Returns the list that lies in the folder of a session; None where there is none."""
    path = Path(session) / FILE
    return PoseList.load(path) if is_file(path) else None


def poses_beside(reference: RecordingSource) -> PoseList | None:
    """Returns the list of the session that a recording is of; None where it is of none, or that has none."""
    typed = reference.metadata.source if isinstance(reference, Recording) else reference
    if not isinstance(typed, str | Path):
        return None
    try:
        path = parse_spec(typed).path
    except LogError:
        return None
    return poses_of(path) if is_folder(path) else None


def keep_poses(session: Path, poses: PoseList) -> None:
    """Stores a list in the folder of a session, unless it is the usual one or already there."""
    if poses is not SIX_FACES and not exists(session / FILE):
        poses.save(session / FILE)
