"""Turntable results for the report's tests: small simulated sessions, fitted with numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from tumble.foundation.results import INTERVAL, LimitCheck, Parameter, Rest, Trace, TriadResult
from tumble.procedures.turntable.result import (
    AxisReading,
    ClockFit,
    MountingResult,
    PoseResult,
    ReferenceResult,
    TargetResult,
    TurntableResult,
)

GRAVITY = 9.80665
REST_SECONDS, TURN_SECONDS = 20.0, 6.0
FACES = {
    "X up": (1.0, 0.0, 0.0),
    "X down": (-1.0, 0.0, 0.0),
    "Y up": (0.0, 1.0, 0.0),
    "Y down": (0.0, -1.0, 0.0),
    "Z up": (0.0, 0.0, 1.0),
    "Z down": (0.0, 0.0, -1.0),
}
POSE_NAMES = (*FACES, *FACES)
R_E = Rotation.from_rotvec([0.6, -0.8, 0.45], degrees=True).as_matrix()
NO_SCALE = "no rotation about this axis was recorded between the rests"


class Session:
    """True motion of the table: specific force of each rest and angular rate of each turn, case frame."""

    def __init__(self, seed: int):
        self.random = np.random.default_rng(seed)
        up = np.array([FACES[name] for name in POSE_NAMES])
        self.table_error = self.random.normal(0.0, 0.05, up.shape)
        tilted = Rotation.from_rotvec(self.table_error, degrees=True).apply(up)
        self.ideal = GRAVITY * up
        self.specific_force = GRAVITY * tilted @ R_E.T
        axes = np.tile(np.eye(3), (4, 1))[: len(up) - 1]
        self.turn_rate = axes * self.random.choice([-1.0, 1.0], (len(axes), 1)) * np.pi / 2 / TURN_SECONDS


def triad_fit(triad, unit, truth, measured, sigma, labels, density, instability):
    """Twelve parameters by least squares, their covariance from the stated sigma."""
    design = np.column_stack([truth, np.ones(len(truth))])
    solution, *_ = np.linalg.lstsq(design, measured, rcond=None)
    M, b = solution[:3].T, solution[3]
    residuals = measured - design @ solution
    unscaled = np.linalg.inv(design.T @ design) * sigma**2
    covariance = np.zeros((12, 12))
    for row in range(3):
        block = [3 * row, 3 * row + 1, 3 * row + 2, 9 + row]
        covariance[np.ix_(block, block)] = unscaled
    K, L, Q = decompose(M)
    return TriadResult(
        triad=triad,
        unit=unit,
        M=M,
        b=b,
        K=K,
        L=L,
        Q=Q,
        covariance=covariance,
        parameters=parameters(M, b, covariance, unit),
        estimated=("bias", "matrix"),
        unobservable=(),
        rank=12,
        chi_square=float(np.sum((residuals / sigma) ** 2)),
        degrees_of_freedom=3 * len(truth) - 12,
        residuals=residuals,
        residual_sigma=np.full(residuals.shape, sigma),
        residual_labels=tuple(labels),
        noise_density=np.full(3, density) * [1.0, 1.05, 1.4],
        bias_instability=np.array([instability, 0.8 * instability, 0.0]),
    )


def decompose(M):
    K = np.diag(np.linalg.norm(M, axis=1))
    sensing = np.linalg.inv(K) @ M
    L = np.linalg.cholesky(sensing @ sensing.T)
    return K, L, np.linalg.inv(L) @ sensing


def named_values(M, b):
    K, _, Q = decompose(M)
    s = np.linalg.inv(K) @ M
    angles = np.degrees(np.arcsin([s[0] @ s[1], s[1] @ s[2], s[2] @ s[0]]))
    return np.concatenate([b, np.diag(K), angles, Rotation.from_matrix(Q).as_rotvec(degrees=True)])


def parameters(M, b, covariance, unit):
    start = np.concatenate([M.ravel(), b])
    values = named_values(M, b)
    step = 1e-6
    jacobian = np.empty((12, 12))
    for column in range(12):
        moved = start.copy()
        moved[column] += step
        jacobian[:, column] = (named_values(moved[:9].reshape(3, 3), moved[9:]) - values) / step
    sigma = np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))
    names = [f"{group} {axis}" for group in ("bias", "scale") for axis in "xyz"]
    names += [f"non-orthogonality {pair}" for pair in ("xy", "yz", "zx")] + [
        f"mounting {axis}" for axis in "xyz"
    ]
    units = [unit] * 3 + ["1"] * 3 + ["deg"] * 6
    return tuple(
        Parameter(
            name, unit, float(value), float(s), float(value - INTERVAL * s), float(value + INTERVAL * s)
        )
        for name, unit, value, s in zip(names, units, values, sigma, strict=True)
    )


def true_model(random, scale, skew_degrees, chip_degrees):
    """M of a sensor with that much scale error, non-orthogonality and chip mounting."""
    K = np.diag(1.0 + random.normal(0.0, scale, 3))
    L = np.eye(3) + np.tril(np.radians(random.normal(0.0, skew_degrees, (3, 3))), -1)
    Q = Rotation.from_rotvec(random.normal(0.0, chip_degrees, 3), degrees=True).as_matrix()
    return K @ L @ Q


def make_rests(force, rate, force_sigma, rate_sigma):
    rests = []
    for index, name in enumerate(POSE_NAMES):
        start = 5.0 + index * (REST_SECONDS + TURN_SECONDS)
        rests.append(
            Rest(
                start=start,
                end=start + REST_SECONDS,
                samples=int(200 * REST_SECONDS),
                specific_force=force[index],
                angular_rate=rate[index],
                specific_force_sigma=np.full(3, force_sigma),
                angular_rate_sigma=np.full(3, rate_sigma),
                pose=name,
            )
        )
    last = rests[-1].end
    knocked = replace(
        rests[-1],
        start=last + 8.0,
        end=last + 14.0,
        samples=1200,
        pose="",
        used=False,
        remark="moved during the rest",
    )
    return (*rests, knocked)


def make_trace(random, rests, turn_rate, noise):
    end = rests[-1].end + 5.0
    time = np.linspace(0.0, end, 600)
    centres = np.array([(rest.start + rest.end) / 2 for rest in rests])
    force = np.column_stack(
        [np.interp(time, centres, [rest.specific_force[axis] for rest in rests]) for axis in range(3)]
    )
    rate = np.zeros_like(force)
    for rest in rests:
        at_rest = (time >= rest.start) & (time <= rest.end)
        force[at_rest] = rest.specific_force
    for rest, turn in zip(rests, turn_rate, strict=False):
        turning = (time > rest.end) & (time < rest.end + TURN_SECONDS)
        rate[turning] = turn
    return Trace(
        time, force + random.normal(0, noise, force.shape), rate + random.normal(0, noise / 20, rate.shape)
    )


def axis_readings(session, measured, sigma):
    compensated = measured @ R_E
    return tuple(
        AxisReading(
            axis=axis,
            labels=POSE_NAMES,
            ideal=session.ideal[:, column],
            uncompensated=measured[:, column],
            compensated=compensated[:, column],
            sigma=np.full(len(measured), sigma),
        )
        for column, axis in enumerate(("X", "Y"))
    )


def make_target(session, name, *, grade=1.0, serial=""):
    """A calibrated target; `grade` multiplies every error of a consumer-grade unit."""
    random = session.random
    sigma, rate_sigma = 4.5e-4 * grade, 4e-5 * grade
    M, b = true_model(random, 0.006 * grade, 0.35 * grade, 0.5 * grade), random.normal(0.0, 0.2 * grade, 3)
    force = session.specific_force @ M.T + b + random.normal(0.0, sigma, session.ideal.shape)
    rates = np.concatenate([np.zeros_like(session.ideal), session.turn_rate])
    gyro_M, gyro_b = (
        true_model(random, 0.01 * grade, 0.3 * grade, 0.5 * grade),
        random.normal(0.0, 0.02 * grade, 3),
    )
    rate = rates @ gyro_M.T + gyro_b + random.normal(0.0, rate_sigma, rates.shape)
    rest_labels = [f"rest {k + 1}: {pose}" for k, pose in enumerate(POSE_NAMES)]
    turn_labels = [f"turn {k + 1}-{k + 2}" for k in range(len(session.turn_rate))]
    rests = make_rests(force, rate, sigma, rate_sigma)
    return TargetResult(
        name=name,
        source=f"recordings/{name}.csv",
        serial=serial,
        accelerometer=triad_fit(
            "accelerometer",
            "m/s^2",
            session.specific_force,
            force,
            sigma,
            rest_labels,
            2.0e-3 * grade,
            4e-4 * grade,
        ),
        gyroscope=triad_fit(
            "gyroscope",
            "rad/s",
            rates,
            rate,
            rate_sigma,
            rest_labels + turn_labels,
            1.2e-4 * grade,
            3e-5 * grade,
        ),
        rests=rests,
        trace=make_trace(random, rests, session.turn_rate, 0.02 * grade),
        clock=ClockFit(
            shared=False, offset=1.23456, offset_sigma=0.0021, skew=14.2, skew_sigma=3.3, turns=11
        ),
        axis_readings=axis_readings(session, force, sigma),
        temperature=(24.1, 24.6, 25.3),
    )


def check(target, bias_limit=0.5):
    """Limits as the limits file would hold them: accelerometer bias and scale, gyroscope bias."""
    lines = []
    for triad, group, unit, limit in (
        (target.accelerometer, "bias", "m/s^2", bias_limit),
        (target.accelerometer, "scale", "1", 0.03),
        (target.gyroscope, "bias", "rad/s", 0.1),
    ):
        for parameter in triad.parameters:
            if parameter.name.startswith(group):
                value = parameter.value - (1.0 if group == "scale" else 0.0)
                lines.append(
                    LimitCheck(
                        f"{triad.triad} {parameter.name}", value, limit, unit, passed=abs(value) <= limit
                    )
                )
    return replace(target, checks=tuple(lines))


def without_gyroscope_matrix(target):
    """The target as it comes out where nothing was rotated: gyroscope bias alone."""
    gyroscope = target.gyroscope
    hidden = tuple(
        parameter
        if parameter.name.startswith("bias")
        else replace(
            parameter, value=np.nan, sigma=np.inf, low=-np.inf, high=np.inf, observable=False, reason=NO_SCALE
        )
        for parameter in gyroscope.parameters
    )
    covariance = gyroscope.covariance.copy()
    covariance[:9, :] = np.nan
    covariance[:, :9] = np.nan
    rests = len(POSE_NAMES)
    return replace(
        target,
        gyroscope=replace(
            gyroscope,
            M=np.eye(3),
            K=np.eye(3),
            L=np.eye(3),
            Q=np.eye(3),
            covariance=covariance,
            parameters=hidden,
            estimated=("bias",),
            unobservable=(
                "scale, non-orthogonality and mounting of the gyroscope: no rotation was recorded",
            ),
            rank=3,
            residuals=gyroscope.residuals[:rests],
            residual_sigma=gyroscope.residual_sigma[:rests],
            residual_labels=gyroscope.residual_labels[:rests],
            chi_square=float(np.sum((gyroscope.residuals / gyroscope.residual_sigma)[:rests] ** 2)),
            degrees_of_freedom=3 * rests - 3,
            bias_instability=np.zeros(3),
        ),
    )


def uncalibrated(target, failure):
    """The target as it comes out where calibration was refused."""
    return replace(target, accelerometer=None, gyroscope=None, clock=None, axis_readings=(), failure=failure)


def make_reference(session):
    rests = make_rests(session.specific_force, np.zeros_like(session.ideal), 7e-5, 2e-6)
    return ReferenceResult(
        name="reference",
        source="recordings/reference.csv",
        serial="HG4930-0042",
        calibration_hash="9f2c" + "0" * 56 + "77aa",
        bias=np.array([1.2e-3, -0.8e-3, 0.3e-3]),
        bias_sigma=np.array([5e-5, 5e-5, 6e-5]),
        norm_residual=1.1e-4,
        gyroscope_bias=np.array([1e-5, -2e-5, 4e-6]),
        gyroscope_bias_sigma=np.array([8e-7, 8e-7, 8e-7]),
        rests=rests,
        trace=make_trace(session.random, rests, session.turn_rate, 0.002),
        mounting=MountingResult(
            rotation_vector=Rotation.from_matrix(R_E).as_rotvec(degrees=True),
            sigma=np.full(3, 0.016),
            R_e=R_E,
        ),
        mounting_reason="",
        temperature=(24.0, 24.3, 24.9),
    )


def make_poses(session):
    poses = []
    for index, (name, up) in enumerate(FACES.items()):
        error = session.table_error[index]
        poses.append(
            PoseResult(
                name=name,
                up_table=np.array(up),
                rests=(index, index + len(FACES)),
                table_error=GRAVITY * np.cross(np.radians(error), up),
                table_error_angle=float(np.linalg.norm(np.cross(error, up))),
                table_error_sigma=0.0012,
            )
        )
    return tuple(poses)


def batch(seed=20240607):
    """One good target, one over a limit, one refused, one without gyroscope scale, one of lower grade."""
    session = Session(seed)
    good = make_target(session, "target_1", grade=0.4, serial="SN-1001")
    limit = make_target(session, "target_2", serial="SN-1002")
    still = make_target(session, "target_4", grade=0.7, serial="SN-1004")
    coarse = make_target(session, "target_5", grade=1.6, serial="SN-1005")
    targets = (
        check(good),
        check(limit, bias_limit=float(np.sort(np.abs(limit.accelerometer.b))[1])),
        uncalibrated(
            make_target(session, "target_3", serial="SN-1003"),
            "3 rests found, 6 needed; rest longer at each pose, or check that the unit was bolted down",
        ),
        check(without_gyroscope_matrix(still)),
        replace(coarse, warnings=("accelerometer x was within 1 % of full scale for 214 samples",)),
    )
    return TurntableResult(
        reference=make_reference(session),
        poses=make_poses(session),
        targets=targets,
        truth="reference",
        gravity=GRAVITY,
        gravity_source="standard",
        options={"truth": "reference", "rest_seconds": 5.0, "g_sensitivity": False},
        warnings=("pose Z down was repeated",),
        software="tumble 0.1.0",
    )


def batch_without_mounting():
    """A session without a pose list: the targets calibrate, the mounting angle is not estimated."""
    result = batch(7)
    reason = "no pose list was given, so the directions of the table are not known"
    return replace(
        result,
        poses=(),
        reference=replace(result.reference, mounting=None, mounting_reason=reason),
        targets=tuple(replace(target, axis_readings=()) for target in result.targets),
    )


def many_targets(count):
    """A batch of that many targets, made from a few by renaming: for size and time, not for statistics."""
    result = batch()
    session = Session(3)
    few = [check(make_target(session, f"unit_{k}", grade=0.5 + 0.1 * k)) for k in range(10)]
    targets = tuple(replace(few[k % len(few)], name=f"unit_{k:03d}") for k in range(count))
    return replace(result, targets=targets)
