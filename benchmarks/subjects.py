"""Pages of docs/benchmarks: a subject each, with the tables that stand on it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Subject:
    """A page of benchmarks."""

    page: str
    """Name of the page in docs/benchmarks, without its ending."""
    title: str
    measured: str
    """Measured figures, for the summary."""
    tables: tuple[str, ...]


SUBJECTS = (
    Subject(
        "honesty",
        "Honesty",
        "silent wrong numbers over sessions with drawn imperfections",
        ("honesty", "honesty_pairs"),
    ),
    Subject(
        "turntable",
        "Turntable",
        "error and coverage, shaking, gaps, late stamps, truths, constant rates",
        ("accuracy", "disturbed", "stamps", "laboratories", "truths", "constant_rates"),
    ),
    Subject(
        "spin",
        "Spin",
        "error and coverage, floors that tilt, live spins, wheels that slip",
        ("spin", "spin_live", "spin_disturbed"),
    ),
    Subject(
        "multipose",
        "Multi-pose",
        "error and coverage without equipment, trembling hands, recordings of others",
        ("multipose", "tremor", "no_equipment"),
    ),
    Subject(
        "magnetometer",
        "Magnetometer",
        "error and coverage by hand and on a turntable, magnets near rests, recordings of others",
        ("magnetometer", "turntable_magnetometer"),
    ),
    Subject(
        "noise-and-temperature",
        "Noise and temperature",
        "terms of noise, disturbed records, order and coefficients of drift, hysteresis",
        ("noise_terms", "noise_disturbed", "thermal", "thermal_loops"),
    ),
    Subject(
        "redundancy",
        "Redundant units",
        "faults found and named, adopted calibrations, single precision, recorded units and flights",
        (
            "redundancy",
            "redundancy_adoptions",
            "redundancy_campaign",
            "redundancy_precision",
            "redundancy_campaign_aiding",
            "redundancy_recorded",
            "flight_campaign",
            "compared_sets",
            "compared_flights",
            "flight_recorded",
            "flight_clocks",
            "flight_logs",
        ),
    ),
    Subject("compare", "Comparing calibrations", "changes that are found, and false ones", ("compare",)),
    Subject(
        "live-and-readers",
        "Live sources and readers",
        "delay and load of live sources, live turntables, time to read and to show a log, the bench page",
        ("live", "live_table", "readers", "view", "bench_page"),
    ),
    Subject(
        "speed",
        "Speed and memory",
        "time of each step, a production line, memory of long recordings",
        ("speed", "production", "memory"),
    ),
    Subject(
        "fleets",
        "Fleets",
        "cost beside a plain loop, a million logs, sessions and random kills on two nodes",
        ("fleet", "fleet_sessions", "fleet_kills"),
    ),
    Subject(
        "device",
        "On a device",
        "flash, memory, stack and instructions of a Cortex-M4F",
        ("footprint", "c_library"),
    ),
)
