"""A turntable batch made up without the estimators: known matrices in the shape that results have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from made_up_calibrations import covariance_of
from tumble.foundation.error_decomposition import mounting_angles
from tumble.foundation.results import INTERVAL, Parameter, Rest, Trace, TriadResult
from tumble.procedures.turntable.result import (
    AxisReading,
    ClockFit,
    MountingResult,
    PoseResult,
    ReferenceResult,
    TargetResult,
    TurntableResult,
)

FACES = ("X up", "X down", "Y up", "Y down", "Z up", "Z down")
PAIRS = {"xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}


def parameters(K, L, Q, b, unit, sigma, unobservable=()):
    """Twelve parameters as the estimator words them; `unobservable` lists groups the data did not show."""
    sensing = L @ Q
    vector = mounting_angles(Q)
    values = [(f"bias {axis}", unit, b[i]) for i, axis in enumerate("xyz")]
    values += [(f"scale {axis}", "1", K[i, i]) for i, axis in enumerate("xyz")]
    values += [
        (f"non-orthogonality {pair}", "deg", np.degrees(np.arcsin(sensing[i] @ sensing[j])))
        for pair, (i, j) in PAIRS.items()
    ]
    values += [(f"mounting {axis}", "deg", vector[i]) for i, axis in enumerate("xyz")]
    found = []
    for name, parameter_unit, value in values:
        hidden = name.split()[0] in unobservable
        spread = float("inf") if hidden else sigma
        found.append(
            Parameter(
                name,
                parameter_unit,
                float(value),
                spread,
                value - INTERVAL * spread,
                value + INTERVAL * spread,
                observable=not hidden,
                reason="no rotation was recorded" if hidden else "",
            )
        )
    return tuple(found)


def triad(name="accelerometer", *, seed=1, bias_only=False):
    """One triad with small random errors."""
    random = np.random.default_rng(seed)
    unit = "m/s^2" if name == "accelerometer" else "rad/s"
    if bias_only:
        K, L, Q = np.eye(3), np.eye(3), np.eye(3)
    else:
        K = np.diag(1 + 0.01 * random.standard_normal(3))
        L = np.tril(0.005 * random.standard_normal((3, 3)), -1)
        L += np.diag(np.sqrt(1 - (L**2).sum(axis=1)))
        Q, _ = np.linalg.qr(np.eye(3) + 0.01 * random.standard_normal((3, 3)))
        Q = Q * np.sign(np.diag(Q))
    b = 0.1 * random.standard_normal(3)
    pairs = dict.fromkeys(("xy", "yz", "zx"), 1e-3)
    of_each = dict.fromkeys(("bias", "scale", "mounting"), np.full(3, 1e-3))
    covariance = covariance_of({**of_each, "non-orthogonality": pairs}, K @ L @ Q)
    hidden = ("scale", "non-orthogonality", "mounting") if bias_only else ()
    if bias_only:
        covariance[:9] = np.nan
        covariance[:, :9] = np.nan
    return TriadResult(
        triad=name,
        unit=unit,
        M=K @ L @ Q,
        b=b,
        K=K,
        L=L,
        Q=Q,
        covariance=covariance,
        parameters=parameters(K, L, Q, b, unit, 1e-3, hidden),
        estimated=("bias",) if bias_only else ("bias", "matrix"),
        unobservable=("scale: no rotation was recorded",) if bias_only else (),
        rank=3 if bias_only else 12,
        chi_square=5.5,
        degrees_of_freedom=6,
        residuals=1e-3 * random.standard_normal((6, 3)),
        residual_sigma=np.full((6, 3), 1e-3),
        residual_labels=tuple(f"rest {i}: {face}" for i, face in enumerate(FACES, start=1)),
        noise_density=np.full(3, 1e-3),
        bias_instability=np.array([1e-4, 0.0, 1e-5]),
    )


def rests():
    """Six rests, one a face."""
    up = np.vstack([sign * np.eye(3)[axis] for axis in range(3) for sign in (1, -1)])
    sigma = np.full(3, 1e-3)
    return tuple(
        Rest(20.0 * i, 20.0 * i + 10.0, 1000, 9.80665 * up[i], np.zeros(3), sigma, sigma, face)
        for i, face in enumerate(FACES)
    )


def trace():
    """A short recording at a glance."""
    return Trace(np.arange(4.0), np.ones((4, 3)), np.zeros((4, 3)))


def target(name="target_1", *, seed=1, gyroscope=True, **changes):
    """One calibrated target; `gyroscope` may be a triad or None, `changes` replace other fields."""
    sigma = np.full(6, 1e-3)
    reading = np.array([9.8, -9.8, 0.0, 0.0, 0.0, 0.0])
    made = TargetResult(
        name=name,
        source=f"{name}.csv",
        serial=f"SN-{seed}",
        accelerometer=triad(seed=seed),
        gyroscope=triad("gyroscope", seed=seed + 100) if gyroscope is True else gyroscope,
        rests=rests(),
        trace=trace(),
        clock=ClockFit(True, 0.0, 0.0, 0.0, 0.0, 0),
        axis_readings=tuple(
            AxisReading(axis, FACES, reading, reading + 0.1, reading + 0.001, sigma) for axis in ("X", "Y")
        ),
        temperature=(24.5, 25.0, 25.5),
    )
    return replace(made, **changes)


def batch(*targets, **changes):
    """A batch of the targets given."""
    mounting = MountingResult(np.array([0.5, -0.3, 1.0]), np.full(3, 0.01), np.eye(3))
    reference = ReferenceResult(
        name="reference",
        source="reference.csv",
        serial="REF-7",
        calibration_hash="",
        bias=np.zeros(3),
        bias_sigma=np.full(3, 1e-4),
        norm_residual=1e-4,
        gyroscope_bias=np.zeros(3),
        gyroscope_bias_sigma=np.full(3, 1e-6),
        rests=rests(),
        trace=trace(),
        mounting=mounting,
        mounting_reason="",
    )
    made = TurntableResult(
        reference=reference,
        poses=tuple(
            PoseResult(rest.pose, rest.specific_force / 9.80665, (i,), np.zeros(3), 0.01, 0.002)
            for i, rest in enumerate(reference.rests)
        ),
        targets=targets or (target(),),
        truth="reference",
        gravity=9.80665,
        gravity_source="standard",
        options={"clock": "auto", "jobs": np.int64(2), "span": (1.0, 2.0)},
        software="tumble 0.1.0",
    )
    return replace(made, **changes)
