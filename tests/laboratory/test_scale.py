"""Questions about one unit cost what its own rows cost, however many others there are."""

from __future__ import annotations

import re

import pytest
from sqlalchemy import event

from drifting_results import drifting
from tumble.laboratory.registry import Registry, UnitFacts

SMALL = {"alembic_version", "registry", "sqlite_master", "pragma_table_info", "CONSTANT", "entry"}
"""Tables of a row or few; of entries only the last one is read, in the order in which they lie."""


def is_scan(step):
    """True for a step of a plan that goes through a whole table that grows."""
    found = re.match(r"SCAN (\w+)\b(?! USING (COVERING )?INDEX)", step)
    return found is not None and found[1] not in SMALL


@pytest.mark.parametrize(
    "ask",
    [
        lambda registry: registry.show("0002"),
        lambda registry: registry.show(registry.show("0002").calibration["calibration"]),
        lambda registry: registry.history("0002"),
        lambda registry: registry.due("0002"),
        lambda registry: registry.list(serial="0002"),
        lambda registry: registry.list(most=10),
        lambda registry: Registry(registry.address.path),
    ],
)
def test_no_question_about_a_unit_scans_a_table(tmp_path, ask):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(drifting(tmp_path / "fleet", units=4, years=3), facts=UnitFacts(model="M1"))
    asked = []

    @event.listens_for(registry.database._engine, "before_cursor_execute")
    def note(_connection, _cursor, statement, parameters, _context, _many):
        if statement.startswith("SELECT") and not statement.startswith("SELECT pg_"):
            asked.append((statement, parameters))

    ask(registry)
    with registry.database.reading() as connection:
        driver = connection.connection.driver_connection
        scanned = set()
        for statement, parameters in asked:
            plan = driver.execute(f"EXPLAIN QUERY PLAN {statement}", parameters).fetchall()
            for *_, step in plan:
                if is_scan(step):
                    scanned.add(f"{step}: {statement}")
    assert scanned == set()


def test_entering_asks_about_the_results_it_was_given_only(tmp_path):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(drifting(tmp_path / "fleet", units=2, years=2))
    asked = []

    @event.listens_for(registry.database._engine, "before_cursor_execute")
    def note(_connection, _cursor, statement, parameters, _context, _many):
        asked.append((statement, parameters))

    registry.add(drifting(tmp_path / "more", units=3, years=1, seed=8))
    with registry.database.reading() as connection:
        driver = connection.connection.driver_connection
        selects = [each for each in asked if each[0].startswith("SELECT")]
        steps = [
            step
            for statement, parameters in selects
            for *_, step in driver.execute(f"EXPLAIN QUERY PLAN {statement}", parameters)
        ]
    assert len(selects) > 3
    assert not [step for step in steps if is_scan(step)]
