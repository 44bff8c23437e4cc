"""Migrations make the tables that the code uses, on both engines."""

from __future__ import annotations

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import text

from tumble.foundation.errors import TumbleError
from tumble.laboratory import database
from tumble.laboratory.database import HEAD
from tumble.laboratory.registry import Registry
from tumble.laboratory.tables import METADATA


def test_migrations_make_the_tables_of_the_code(registry):
    with registry.database.reading() as connection:
        assert compare_metadata(MigrationContext.configure(connection), METADATA) == []


def test_the_version_of_the_code_is_that_of_the_last_migration():
    config = Config()
    config.set_main_option("script_location", "tumble.laboratory:migrations")
    assert ScriptDirectory.from_config(config).get_current_head() == HEAD


def test_a_registry_that_is_up_to_date_is_made_only_once(registry, address):
    again = Registry.create(address)
    assert again.identifier == registry.identifier
    assert len(again.entries()) == 1


def test_a_registry_of_a_newer_version_is_refused_in_one_line(registry, address):
    with registry.database.writing() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '99'"))
    for attempt in (lambda: Registry(address), lambda: Registry.create(address, documents="x")):
        with pytest.raises(TumbleError, match="made by a newer Tumble") as error:
            attempt()
        assert "\n" not in str(error.value)


def test_a_version_of_no_registry_is_one_line(registry, address):
    for stated in ("0", "-5", "001", "+1", "1.0", " 1", "1\n", "", "one", "\u0661", "\u00b9", "9" * 32 + "x"):
        with registry.database.writing() as connection:
            connection.execute(
                text("UPDATE alembic_version SET version_num = :stated"), {"stated": stated[-32:]}
            )
        for attempt in (lambda: Registry(address), lambda: Registry.create(address, documents="x")):
            with pytest.raises(TumbleError, match="of its tables, as no registry does") as error:
                attempt()
            assert "\n" not in str(error.value)


def test_an_older_registry_is_upgraded_by_init_only(registry, address, monkeypatch):
    monkeypatch.setattr(database, "HEAD", "2")
    with pytest.raises(TumbleError, match="back it up and type tumble registry init"):
        Registry(address)
