"""Stations that issue certificates at once and are killed at any moment: no number twice, none missing."""

from __future__ import annotations

import random

from certificate_issuer import issue
from forked_stations import Station
from made_up_calibrations import made_up, save
from repetitions import SOAK
from tumble.laboratory.certificate import record
from tumble.laboratory.registry import Registry


def test_stations_killed_at_random_leave_no_gap_of_numbers(registry, tmp_path):
    seed, stations, kills, units = 12, *((6, 60, 120) if SOAK else (3, 4, 12))
    print("seed", seed)
    drawn = random.Random(seed)
    made = [made_up(serial=str(n), log=str(n)) for n in range(units)]
    results = [each.identity for each in registry.add(save(tmp_path / "results", *made))]
    place = registry.address.url or registry.address.path
    text = str(place) if registry.address.path else place.render_as_string(hide_password=False)
    address = text.replace("+psycopg", "")
    running = [Station(issue, address, drawn.sample(results, units)) for _ in range(stations)]
    for _ in range(kills):
        victim = running.pop(drawn.randrange(len(running)))
        # It goes on while it is received, so that it is killed in the midst of something.
        for _ in range(drawn.randint(0, 3)):
            victim.receive()
        victim.kill()
        victim.receive_all()
        running.append(Station(issue, address, drawn.sample(results, units)))
    for each in running:
        each.receive_all()
    assert [each.exit_code for each in running] == [0] * stations
    opened = Registry(address)
    assert sorted(int(row["number"]) for row in record.listed(opened)) == list(range(1, units + 1))
    assert sorted(record.holding(opened, results)) == sorted(results)
    found = opened.verify()
    assert found.intact, found.faults
