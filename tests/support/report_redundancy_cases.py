"""Replays of redundant sets as the report is given them: a whole mission, and cases with little in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tumble._core import VOCABULARY
from tumble.procedures.redundancy.result import (
    UNKNOWN,
    RedundancyEvent,
    RedundancyResult,
    SecondaryError,
    Selected,
    UnitTrace,
)

ACCELEROMETER_BIAS = np.array([0.3, -0.2, 0.1])
GYROSCOPE_BIAS = np.array([0.02, -0.03, 0.01])
ADOPTED = 60.0
TOOK_OVER = 90.0
LEFT_IN_FORCE, LEFT_IN_RATE = 0.004, 0.0005
"""Difference that noise leaves after adoption, m/s^2 and rad/s, a channel."""

EVERY_EVENT = {
    "rest began": [{}],
    "rest ended": [{}],
    "evaluated": [
        {"sensor": sensor, "check": check, "deviation": 0.3, "threshold": 0.1, "exceeded": True}
        for sensor in ("accelerometer", "gyroscope")
        for check in ("norm", "vector")
    ],
    "withheld": [{"sensor": "gyroscope", "reason": reason} for reason in VOCABULARY["withheld"]],
    "triggered": [{"sensors": sensors} for sensors in ("accelerometer", "gyroscope", "both")],
    "motion began": [{}],
    "fitted": [
        {
            "sensor": "gyroscope",
            "fit_model": "gain",
            "directions": 2,
            "pairs": 321,
            "residual": 0.0004,
            "residual_before": 0.03,
        }
    ],
    "adopted": [
        {
            "sensor": "accelerometer",
            "fit_model": "affine",
            "directions": 3,
            "residual": 0.004,
            "residual_before": 0.3,
            "sequence": 7,
        }
    ],
    "refused": [
        {"sensor": "accelerometer", "reason": reason, "value": 0.42, "limit": 0.1}
        for reason in VOCABULARY["refused"]
    ],
    "abandoned": [{"reason": reason} for reason in VOCABULARY["abandoned"]],
    "unhealthy": [
        {"reason": reason, "channel": "angular rate z", "value": 12.0, "limit": 10.0}
        for reason in VOCABULARY["unhealthy"]
    ]
    + [
        {
            "sensor": "accelerometer",
            "reason": "out of family",
            "value": 1.02,
            "limit": 0.21,
            "scale": 0.1,
            "agreeing": ("imu1", "imu3"),
        }
    ]
    + [
        {"sensor": "gyroscope", "reason": "isolated", "ground": ground, "value": 0.93, "limit": 0.5}
        for ground in VOCABULARY["ground"]
    ],
    "healthy": [{}],
    "disagree": [
        {"sensor": "accelerometer", "other": ("imu3",), "value": 1.02, "limit": 0.21, "scale": 10.0}
    ],
    "agree": [{"sensor": "accelerometer", "other": ("imu3",)}],
    "aiding left out": [{"reason": reason} for reason in VOCABULARY["aiding left out"]],
    "aiding distrusted": [{"value": 7.2, "limit": 5.0}],
    "aiding trusted": [{}],
    "selected": [{"reason": reason} for reason in VOCABULARY["selected"]],
    "restored": [{"sensor": "gyroscope", "sequence": 3}],
    "record rejected": [
        {"sensor": "gyroscope", "reason": reason, "detail": "file x"}
        for reason in (*VOCABULARY["record rejected"], "corrupt", "against another primary")
    ],
    "time jumped": [{"by": -3.5}],
    "all saturated": [{"sensor": "accelerometer"}],
}
"""Every event of docs/how-to/redundancy.md with every reason it can have."""


def event(time, unit, name, **figures):
    return RedundancyEvent(time, unit, name, figures)


def evaluated(time, unit, force, rate, exceeded, check="norm", limits=(0.1, 0.01)):
    return [
        event(time, unit, "evaluated", sensor=s, check=check, deviation=d, threshold=t, exceeded=exceeded)
        for s, d, t in zip(("accelerometer", "gyroscope"), (force, rate), limits, strict=True)
    ]


def error(unit="imu2", sensor="accelerometer", **changes):
    """An error fitted whole; `changes` replace its fields."""
    force = sensor == "accelerometer"
    fitted = {
        "unit": unit,
        "sensor": sensor,
        "matrix": np.array([[1.01, 0.001, 0.0], [0.0, 0.99, 0.002], [0.0, 0.0, 1.005]]),
        "bias": ACCELEROMETER_BIAS if force else GYROSCOPE_BIAS,
        "matrix_sigma": np.full((3, 3), 1e-4),
        "bias_sigma": np.full(3, 1e-3 if force else 1e-4),
        "lever_arm": np.array([0.021, -0.012, 0.003]) if force else None,
        "lever_arm_sigma": np.full(3, 2e-4) if force else None,
        "fit_model": "affine and lever arm" if force else "affine",
        "directions": 3,
        "residual": LEFT_IN_FORCE if force else LEFT_IN_RATE,
        "residual_before": 0.28 if force else 0.026,
        "pairs": 400,
        "sequence": 1,
        "adopted": ADOPTED,
    }
    return SecondaryError(**(UNKNOWN | fitted | changes))


def settings(**changes):
    return {
        "rest_specific_force_scatter": 0.1,
        "secondary_accelerometer_threshold": "0.1",
        "vector_check": True,
        "return_after": None,
    } | changes


def trace(name, time, force, rate, adopted=np.inf):
    """A unit whose errors, (3,) m/s^2 and rad/s, are known from `adopted` on."""
    generator = np.random.default_rng(sum(name.encode()))
    known = (time > adopted)[:, None]
    truth_force = np.column_stack([np.sin(time), np.cos(time), np.full(len(time), 9.8)])
    truth_rate = 0.3 * np.column_stack([np.cos(time), np.sin(time), np.sin(2 * time)])
    noisy_force = truth_force + LEFT_IN_FORCE / np.sqrt(2) * generator.standard_normal((len(time), 3))
    noisy_rate = truth_rate + LEFT_IN_RATE / np.sqrt(2) * generator.standard_normal((len(time), 3))
    return UnitTrace(
        name,
        noisy_force + force,
        noisy_rate + rate,
        noisy_force + np.where(known, 0.0, force),
        noisy_rate + np.where(known, 0.0, rate),
    )


def mission():
    """One secondary is calibrated and takes over, another is refused."""
    events = [
        event(0.0, "imu1", "selected", reason="start"),
        event(0.6, "imu1", "rest began"),
        *evaluated(2.6, "imu1", 0.002, 0.0003, False),
        *evaluated(2.6, "imu2", 0.3, 0.03, True),
        *evaluated(2.6, "imu2", 0.37, 0.037, True, "vector"),
        event(2.6, "imu2", "triggered", sensors="both"),
        *evaluated(2.6, "imu3", 0.2, 0.003, True),
        event(2.6, "imu3", "triggered", sensors="accelerometer"),
        event(10.0, "imu1", "rest ended"),
        event(10.2, "imu2", "motion began"),
        event(10.2, "imu3", "motion began"),
        *(
            event(
                ADOPTED,
                "imu2",
                name,
                sensor=each.sensor,
                fit_model=each.fit_model,
                directions=3,
                residual=each.residual,
                residual_before=each.residual_before,
                **({"pairs": 400} if name == "fitted" else {"sequence": 1}),
            )
            for each in (error(), error(sensor="gyroscope"))
            for name in ("fitted", "adopted")
        ),
        event(
            61.0, "imu3", "refused", sensor="accelerometer", reason="not better", value=0.0049, limit=0.0048
        ),
        event(80.0, "imu1", "rest began"),
        *evaluated(82.0, "imu2", 0.004, 0.0004, False, limits=(0.12, 0.012)),
        event(89.98, "imu1", "unhealthy", reason="late", value=0.11),
        event(TOOK_OVER, "imu2", "selected", reason="primary failed"),
    ]
    time = np.arange(0.025, 100.0, 0.05)
    primary = trace("imu1", time, np.zeros(3), np.zeros(3))
    for values in (primary.specific_force, primary.angular_rate):
        values[time > 89.9] = np.nan
    return RedundancyResult(
        primary="imu1",
        secondaries=("imu2", "imu3"),
        start=0.0,
        end=100.0,
        settings=settings(secondary_accelerometer_threshold="last+0.05", return_after=5.0),
        events=tuple(events),
        errors=(error(), error(sensor="gyroscope")),
        window_time=time,
        traces=(
            primary,
            trace("imu2", time, ACCELEROMETER_BIAS, GYROSCOPE_BIAS, ADOPTED),
            trace("imu3", time, np.full(3, 0.1), np.full(3, 0.001)),
        ),
        selected=(
            Selected(0.0, TOOK_OVER, "imu1", "start"),
            Selected(TOOK_OVER, 100.0, "imu2", "primary failed"),
        ),
        replay_rate=12345.0,
        warnings=("the clocks are taken to be one",),
        software="tumble 0",
        serials={"imu1": "SN-1"},
        defaults=settings(),
    )


def quiet():
    """No unit ever sent a sample."""
    nothing = np.empty((0, 3))
    return replace(
        mission(),
        events=(),
        errors=(),
        selected=(),
        window_time=np.empty(0),
        traces=tuple(UnitTrace(name, *[nothing] * 4) for name in ("imu1", "imu2", "imu3")),
        warnings=(),
    )


def untriggered():
    """All deviations are below their thresholds."""
    events = [event(0.0, "imu1", "selected", reason="start"), event(0.6, "imu1", "rest began")]
    for unit in ("imu1", "imu2", "imu3"):
        events += evaluated(2.6, unit, 0.01, 0.001, False)
    return replace(
        mission(), events=tuple(events), errors=(), selected=(Selected(0.0, 100.0, "imu1", "start"),)
    )


def missing():
    """The second secondary sends nothing from the start."""
    made = mission()
    nothing = UnitTrace("imu3", *(np.full((len(made.window_time), 3), np.nan) for _ in range(4)))
    events = [each for each in made.events if each.unit != "imu3"]
    late = event(0.1, "imu3", "unhealthy", reason="late", value=0.1)
    return replace(made, events=(late, *events), traces=(*made.traces[:2], nothing))


def unfit():
    """No unit is ever fit to be the source."""
    events = [
        *(event(0.1, unit, "unhealthy", reason="late", value=0.1) for unit in ("imu1", "imu2", "imu3")),
        event(0.12, "imu1", "selected", reason="none fit"),
    ]
    return replace(quiet(), events=tuple(events), selected=(Selected(0.12, 100.0, "", "none fit"),))


def disputed():
    """Two units disagree from some time on, to the end."""
    apart = {"sensor": "accelerometer", "other": ("imu2",), "value": 1.02, "limit": 0.21, "scale": 0.1}
    made = untriggered()
    return replace(made, events=(*made.events, event(46.6, "imu1", "disagree", **apart)))


def everything():
    """Every event with every reason, one a second."""
    kinds = [(name, figures) for name, all_figures in EVERY_EVENT.items() for figures in all_figures]
    events = [event(float(at), "imu2", name, **figures) for at, (name, figures) in enumerate(kinds)]
    return replace(mission(), events=tuple(events))


def unseen():
    """An error of which the motion showed a part only, and one that was never measured."""
    matrix_sigma = np.full((3, 3), 1e-4)
    matrix_sigma[:, 0] = np.inf
    part = error(directions=2, matrix_sigma=matrix_sigma, lever_arm_sigma=np.array([np.inf, 1e-3, 1e-3]))
    given = error(
        sensor="gyroscope",
        fit_model="offset",
        directions=0,
        matrix_sigma=np.full((3, 3), np.inf),
        residual=np.nan,
        residual_before=np.nan,
        adopted=None,
        sequence=0,
    )
    return replace(mission(), errors=(part, given))


def long_day(units=8, hours=24.0):
    """The largest number of units, evaluated every few seconds, with faults that flicker, all day."""
    names = tuple(f"imu{number}" for number in range(1, units + 1))
    end = 3600.0 * hours
    events = []
    for at in np.arange(10.0, end, 100.0):
        events += [event(at, names[0], "rest began"), event(at + 50.0, names[0], "rest ended")]
        for unit in names:
            events += evaluated(at + 2.0, unit, 0.3, 0.03, True)
            events += evaluated(at + 2.0, unit, 0.2, 0.02, True, "vector")
            events += [
                event(
                    at + 3.0, unit, "refused", sensor="gyroscope", reason="not better", value=1.0, limit=0.9
                ),
                event(at + 4.0, unit, "unhealthy", reason="late", value=0.1),
                event(at + 4.5, unit, "healthy"),
            ]
    time = np.arange(0.0, end, 2.0)
    generator = np.random.default_rng(4)
    return replace(
        mission(),
        secondaries=names[1:],
        primary=names[0],
        end=end,
        events=tuple(sorted(events, key=lambda each: each.time)),
        errors=tuple(error(unit, sensor) for unit in names[1:] for sensor in ("accelerometer", "gyroscope")),
        window_time=time,
        traces=tuple(
            UnitTrace(name, *(generator.standard_normal((len(time), 3)) for _ in range(4))) for name in names
        ),
        selected=tuple(
            Selected(at, at + 100.0, names[number % units], "source failed")
            for number, at in enumerate(np.arange(0.0, end, 100.0))
        ),
    )
