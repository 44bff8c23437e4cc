"""Procedures on the units of a screen: those of one unit, and those that take units together."""

from __future__ import annotations

from tumble.bench.log.procedure_panel import procedures_of_several, run_procedure, usual_first
from tumble.tools.view.viewing import open_viewing
from turntable_sessions import typed


def rows():
    return {each.word: each for each in procedures_of_several()}


def gathered(*sources):
    viewing = open_viewing([str(source) for source in sources])
    viewing.gather()
    assert viewing.is_done
    return viewing


def test_units_of_a_turntable_give_the_files_of_the_command(tmp_path):
    made = tmp_path / "made"
    assert typed("simulate", "turntable", "-o", made, "--seed", 5).code == 0
    logs = [made / "reference.csv", made / "target_1.csv"]
    viewing = gathered(*logs)
    assert usual_first([unit.name for unit in reversed(viewing.units)]) == "reference"
    verdict, files = run_procedure(rows()["turntable"], viewing.units, (), viewing, tmp_path / "page")
    typed("turntable", *logs, "-o", tmp_path / "command")
    assert verdict == "calibrated"
    assert files["report"].is_file()
    name = "target_1.yaml"
    assert (tmp_path / "page" / name).read_bytes() == (tmp_path / "command" / name).read_bytes()


def test_a_set_is_aligned_and_replayed_on_chosen_sections(tmp_path):
    made = tmp_path / "made"
    assert typed("simulate", "flight", "-o", made, "--seed", 5).code == 0
    viewing = gathered(made / "primary.csv", made / "secondary_1.csv")
    sections = [(0.0, viewing.duration / 2.0)]
    verdict, files = run_procedure(rows()["align"], viewing.units, sections, viewing, tmp_path / "align")
    assert verdict in ("aligned", "partly aligned")
    assert "secondary_1" in files["report"].read_text()
    verdict, files = run_procedure(rows()["redundancy"], viewing.units, sections, viewing, tmp_path / "set")
    assert verdict in ("pass", "calibrated", "not calibrated")
    assert "only from 0.000" in files["report"].read_text()
