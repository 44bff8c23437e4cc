"""Logs of robots that turned."""

import pytest

from turntable_sessions import typed


@pytest.fixture(scope="session")
def logs(tmp_path_factory):
    """Returns a folder with logs of four robots in two lots, and one file that is none."""
    folder = tmp_path_factory.mktemp("fleet")
    for seed in range(4):
        made = folder / f"made_{seed}"
        assert typed("simulate", "spin", "-o", made, "--seed", seed).code == 0
        lot = folder / "logs" / f"lot{seed % 2}"
        lot.mkdir(parents=True, exist_ok=True)
        (made / "spin.csv").rename(lot / f"robot{seed}.csv")
    (folder / "logs" / "lot0" / "broken.csv").write_text("broken\n")
    return folder / "logs"
