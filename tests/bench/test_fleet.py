"""Jobs of fleets as the bench sees them: found in a folder, far or near, damaged or killed."""

from __future__ import annotations

import pytest

from made_up_fleets import FAILURE, MOVED, write_fleets
from tumble.bench.fleet_view import FleetView
from tumble.fleet.ledger import is_cancelled
from tumble.fleet.places import FileStore
from tumble.foundation.errors import TumbleError


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    found = tmp_path_factory.mktemp("fleets")
    write_fleets(found)
    (found / "limits.yaml").write_text("schema: tumble-limits/1\naccelerometer: {bias: 0.3}\n")
    return found


def test_jobs_of_a_folder_show_how_far_they_are(folder):
    found = {each.name: each for each in FleetView(folder).jobs()}
    assert {name: each.state for name, each in found.items()} == {
        "spins.yaml": "done",
        "drives.yaml": "running",
        "killed.yaml": "silent",
        "next.yaml": "not begun",
        "broken.yaml": "unreadable",
    }
    assert found["drives.yaml"].share == 0.25
    assert found["spins.yaml"].results == str(folder / "spins-results")
    assert "nonsense" in found["broken.yaml"].trouble


def test_results_of_a_job_show_failures_due_units_and_drift(folder):
    view = FleetView(folder)
    summary = view.summary("spins.yaml", folder / "limits.yaml")
    tables = {table.title: table.rows for table in view.tables(summary)}
    assert tables["Failed"] == (("spins/none.csv", FAILURE),)
    assert [row[0] for row in tables["Moved beyond chance"]] == [MOVED]
    assert [row[0] for row in tables["Drift of lots"]] == ["lot-0", "lot-1"]
    assert tables["Due"]
    assert MOVED in view.page(summary)


def test_only_a_running_job_of_the_folder_is_cancelled(folder):
    view = FleetView(folder)
    view.cancel("drives.yaml")
    assert is_cancelled(FileStore(str(folder / "drives-results")))
    for name, why in (("spins.yaml", "is done"), ("../spins.yaml", "no such job"), ("none", "no such job")):
        with pytest.raises(TumbleError, match=why):
            view.cancel(name)
