"""Results enter the registry once and come out as they went in, on both engines."""

from __future__ import annotations

import csv
import json
import shutil

import pytest

import tumble
from made_up_calibrations import BIAS_SIGMA, COMMON_SIGMA, made_up, save
from tumble.foundation import stores
from tumble.foundation.errors import OutputError, TumbleError
from tumble.laboratory import equipment
from tumble.laboratory.documents import Documents
from tumble.laboratory.export import write_documents
from tumble.laboratory.registry import Registry, UnitFacts


def test_a_result_comes_out_as_it_went_in(registry, tmp_path):
    folder = save(tmp_path / "results", made_up(bias=(0.125, -0.25, 1e-17)))
    (added,) = registry.add(folder, facts=UnitFacts(manufacturer="Acme", model="M1", lot="7"))
    shown = registry.show(added.identity[:8])
    assert shown.unit["serial"] == "0042"
    assert (shown.unit["manufacturer"], shown.unit["model"], shown.unit["lot"]) == ("Acme", "M1", "7")
    assert (shown.session["procedure"], shown.session["operator"]) == ("turntable", "Ann")
    assert shown.recordings[0]["file"] == "log.csv"
    numbers = {row["name"]: row for row in shown.parameters}
    assert numbers["accelerometer bias x"]["value"] == 0.125
    assert numbers["accelerometer bias z"]["value"] == 1e-17
    assert numbers["accelerometer bias y"]["u"] == BIAS_SIGMA
    assert numbers["accelerometer bias y"]["common"] == COMMON_SIGMA
    assert numbers["accelerometer scale x"]["value"] == 1.0
    document = registry.document(shown.calibration["document"])
    assert document == (folder / "result_0.yaml").read_bytes()
    written = list(write_documents(registry, shown, tmp_path / "again"))
    assert [path.read_bytes() for path in written] == [
        (folder / f"result_0{ending}").read_bytes() for ending in (".yaml", ".html")
    ]


def test_the_same_run_twice_is_one_entry(registry, tmp_path):
    folder = save(tmp_path / "results", made_up())
    (first,) = registry.add(folder)
    later = save(tmp_path / "later", made_up(date="2026-02-01T00:00:00Z", operator="Bob"))
    (second,) = registry.add(later)
    assert (first.is_new, second.is_new) == (True, False)
    assert first.identity == second.identity
    assert len(registry.list()) == 1
    assert len(registry.entries()) == 2


@pytest.mark.parametrize(
    "other",
    [
        {"log": "another log"},
        {"clock": "fixed"},
        {"bias": (0.1, -0.2, 0.3001)},
        {"serial": "0043"},
        {"limits": {"accelerometer": {"bias": 0.5}}},
    ],
)
def test_other_inputs_options_or_limits_are_another_result(tmp_path, other):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up()), save(tmp_path / "b", made_up(**other)))
    assert len(registry.list()) == 2


def test_a_folder_gives_results_of_procedures_only(registry, tmp_path):
    folder = save(tmp_path / "results", made_up())
    content = made_up(serial="9").content() | {"method": {"procedure": "import"}}
    tumble.Calibration.model_validate(content).save(folder / "imported.yaml")
    (folder / "notes.yaml").write_text("a: 1\n")
    assert [each.serial for each in registry.add(folder)] == ["0042"]
    with pytest.raises(TumbleError, match=r"imported\.yaml: was made by import"):
        registry.add(folder / "imported.yaml")


def test_results_are_listed_latest_first_and_by_what_is_asked(registry, tmp_path):
    dates = ["2026-01-01T00:00:00Z", "2026-03-01T00:00:00Z", "2026-02-01T00:00:00Z"]
    for number, date in enumerate(dates):
        made = made_up(serial=f"{number % 2}", log=f"log {number}", date=date)
        registry.add(save(tmp_path / str(number), made), facts=UnitFacts(lot=f"{number % 2}"))
    assert [row["date"] for row in registry.list()] == sorted(dates, reverse=True)
    assert {row["serial"] for row in registry.list(serial="0")} == {"0"}
    assert len(registry.list(lot="1")) == len(registry.list(serial="1")) == 1
    assert len(registry.list(procedure="spin")) == 0
    frame = registry.list().to_pandas()
    assert list(frame["date"]) == sorted(dates, reverse=True)


def test_what_becomes_known_of_a_unit_supersedes_what_was(registry, tmp_path):
    registry.add(save(tmp_path / "a", made_up()))
    registry.add(save(tmp_path / "b", made_up(log="b")), facts=UnitFacts(model="M1"))
    registry.add(save(tmp_path / "c", made_up(log="c")), facts=UnitFacts(model="M1", owner="Fleet"))
    (unit,) = registry.units()
    assert (unit["model"], unit["owner"]) == ("M1", "Fleet")
    assert len(registry.list(model="M1")) == 3


def test_a_result_added_again_completes_its_unit_and_changes_nothing(registry, tmp_path):
    folder = save(tmp_path / "a", made_up())
    registry.add(folder)
    registry.add(folder, facts=UnitFacts(model="M1"))
    registry.add(folder, facts=UnitFacts(model="M2", lot="7"))
    (unit,) = registry.units()
    assert (unit["model"], unit["lot"]) == ("M1", "7")
    assert len(registry.list()) == 1
    assert registry.verify().intact


def test_one_serial_of_two_models_is_two_units(registry, tmp_path):
    for model in ("M1", "M2"):
        registry.add(save(tmp_path / model, made_up(log=model)), facts=UnitFacts(model=model))
    assert len(registry.units()) == 2
    with pytest.raises(TumbleError, match="give --model"):
        registry.add(save(tmp_path / "c", made_up(log="c")))


def test_a_result_that_supersedes_names_the_one_before(registry, tmp_path):
    (first,) = registry.add(save(tmp_path / "a", made_up()), condition="as found")
    (second,) = registry.add(
        save(tmp_path / "b", made_up(log="b")), condition="as left", supersedes=first.identity[:10]
    )
    assert registry.show(first.identity).superseded_by == (second.identity,)
    assert registry.show(second.identity).calibration["condition"] == "as left"


def test_a_decision_says_which_parameter_is_beyond_its_limit(registry, tmp_path):
    limits = {"accelerometer": {"bias": 0.25, "scale": 0.01}}
    (added,) = registry.add(save(tmp_path / "a", made_up(limits=limits, verdict="fail")))
    (decision,) = registry.show(added.identity).decisions
    assert (decision["rule"], decision["verdict"]) == ("simple", "fail")
    assert decision["why"] == "accelerometer bias z 0.3 beyond 0.25 m/s^2"


def test_a_part_taken_over_keeps_the_run_that_measured_it(registry, tmp_path):
    content = made_up().content()
    (first,) = registry.add(save(tmp_path / "a", made_up()))
    content["contributions"] = [
        {
            "gave": ["accelerometer noise"],
            "method": {"procedure": "noise"},
            "date": "2026-02-01T00:00:00Z",
            "verdict": "measured",
            "logs": [{"file": "night.csv", "sha256": "ab"}],
        }
    ]
    content["accelerometer"]["noise_density"] = [1e-3, 2e-3, 3e-3]
    (second,) = registry.add(save(tmp_path / "b", tumble.Calibration.model_validate(content)))
    before, after = registry.show(first.identity), registry.show(second.identity)
    assert after.session["procedure"] == "noise"
    origins = [
        {row["name"]: row["origin"] for row in shown.parameters}["accelerometer bias x"]
        for shown in (before, after)
    ]
    assert origins[0] == origins[1]
    noise = {row["name"]: row for row in after.parameters}["accelerometer noise-density y"]
    assert (noise["value"], noise["measured"]) == (2e-3, "2026-02-01T00:00:00Z")
    assert noise["origin"] != origins[0]


def test_no_cell_of_an_export_is_a_formula(registry, tmp_path):
    registry.add(save(tmp_path / "a", made_up(serial="=1+1", name="@unit")))
    count = registry.export(tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == count == 12
    assert {(row["serial"], row["name"]) for row in rows} == {("'=1+1", "'@unit")}
    bias = {row["parameter"]: float(row["value"]) for row in rows}
    assert bias["accelerometer bias y"] == -0.2
    registry.export(tmp_path / "table.json")
    (first, *_) = json.loads((tmp_path / "table.json").read_text())
    assert first["serial"] == "=1+1"


def test_text_that_an_engine_refuses_is_escaped(registry, tmp_path):
    odd = made_up(name="nul \x00 and \x1b[31m", operator="\ud800 O'Brien; DROP TABLE unit")
    (added,) = registry.add(save(tmp_path / "a", odd), facts=UnitFacts(model="a\x00b"))
    assert registry.show(added.identity).unit["model"] == "a\\x00b"
    assert "O'Brien; DROP TABLE unit" in registry.show(added.identity).session["operator"]
    assert registry.verify().intact


def test_a_backup_is_the_same_chain_in_a_file(registry, tmp_path):
    registry.add(save(tmp_path / "a", made_up(), made_up(serial="2", log="2")))
    copied = registry.backup(tmp_path / "backup")
    assert copied.head == registry.verify().head
    documents, kept = tmp_path / "documents", tmp_path / "backup" / "registry-documents"
    assert {path.name for path in kept.rglob("*") if path.is_file()} == {
        path.name for path in documents.rglob("*") if path.is_file()
    }
    shutil.rmtree(documents)
    copy = Registry(tmp_path / "backup" / "registry.db")
    assert copy.verify().intact
    assert [*copy.entries()] == [*registry.entries()]
    assert [*copy.list()] == [*registry.list()]
    (added,) = copy.add(save(tmp_path / "b", made_up(serial="3", log="3")))
    assert added.is_new
    with pytest.raises(TumbleError, match="give a new folder"):
        registry.backup(tmp_path / "backup")


def test_a_backup_that_fails_is_none_and_can_be_made_again(registry, tmp_path, monkeypatch):
    registry.add(save(tmp_path / "a", made_up()))
    read = Documents.read

    def without_room(documents, digest):
        raise OutputError("no room")

    monkeypatch.setattr(Documents, "read", without_room)
    with pytest.raises(OutputError, match="no room"):
        registry.backup(tmp_path / "backup")
    assert not [path for path in (tmp_path / "backup").iterdir() if path.suffix == ".db"]
    (tmp_path / "backup" / "unfinished.db").touch()  # of one that was killed at its beginning
    monkeypatch.setattr(Documents, "read", read)
    assert registry.backup(tmp_path / "backup").intact


def test_equipment_past_its_date_is_listed_first(registry, tmp_path):
    equipment.add(registry, "table 1", {"kind": "table"})
    equipment.add(registry, "reference 1", {"kind": "reference", "due": "2020-01-01"})
    assert [(row["name"], row["overdue"]) for row in registry.equipment()] == [
        ("reference 1", True),
        ("table 1", False),
    ]
    (tmp_path / "certificate.pdf").write_bytes(b"%PDF")
    equipment.add(registry, "reference 1", {"due": "2999-01-01"}, tmp_path / "certificate.pdf")
    equipment.add(registry, "reference 1", {"due": "2999-01-01"})
    (reference, _) = registry.equipment()
    assert (reference["overdue"], reference["kind"]) == (False, "reference")
    assert registry.document(reference["document"]) == b"%PDF"
    assert len(registry.entries()) == 4
    with pytest.raises(TumbleError, match="is new; give --kind"):
        equipment.add(registry, "chamber", {})


def test_the_place_of_documents_on_a_server_is_asked_for(server):
    with pytest.raises(TumbleError, match="give --documents"):
        Registry.create(server.make("without_documents"))


def test_documents_go_where_a_url_leads(tmp_path, monkeypatch):
    monkeypatch.setattr(stores, "STORES", {"memory"})
    registry = Registry.create(tmp_path / "lab.db", documents="memory://registry-documents")
    (added,) = registry.add(save(tmp_path / "a", made_up()))
    shown = registry.show(added.identity)
    assert registry.document(shown.calibration["document"]).startswith(b"# Calibration")
    assert registry.verify().documents == 2
    assert registry.verify().intact


@pytest.mark.parametrize(
    "stated", [{"documents": "zip://a"}, {"documents": "nonsense://a"}, {"laboratory": "x" * 5000}]
)
def test_a_registry_that_cannot_be_made_leaves_no_file(tmp_path, stated):
    with pytest.raises(TumbleError):
        Registry.create(tmp_path / "lab.db", **stated)
    assert not list(tmp_path.iterdir())
