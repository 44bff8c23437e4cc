"""Spin results for the report's tests: made up with numpy, every number known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tumble.foundation.results import INTERVAL, Parameter, Rest, Trace
from tumble.procedures.spin.result import BiasEstimate, Spin, SpinBlocks, SpinResult

GRAVITY = 9.80665
BLOCK, RATE_HZ = 0.2, 100.0
FORCE_BIAS = np.array([0.2013, -0.1507, 0.3021])
FORCE_SIGMA = np.array([0.0011, 0.0012, 0.00041])
RATE_BIAS = np.array([0.02013, -0.01009, 0.01502])
RATE_SIGMA = np.array([3.1e-5, 3.2e-5, 4.3e-5])
UP = np.array([0.0349, 0.0523, 0.99802])
UP = UP / np.linalg.norm(UP)
TILT, UPHILL = 1.03, 37.5
"""deg."""
TILTED = GRAVITY * np.sin(np.radians(TILT)) * np.array([0.79, 0.61, -0.06])
"""Error that the tilt of the floor causes in the published bias, m/s^2."""
ARM = np.array([0.1012, -0.0603, -0.0004])
NO_TRUTH = "the angle truly turned is not known; give it with --true-turns"
NO_LEVEL_FREE = "60 deg of heading do not separate bias from the tilt of the floor"
NO_TILT = "the heading changed too little to separate the tilt of the floor from bias"


def parameter(name, unit, value, sigma):
    half = INTERVAL * sigma
    return Parameter(name, unit, value, sigma, value - half, value + half)


def hidden(name, unit, reason):
    return Parameter(name, unit, np.nan, np.inf, np.nan, np.nan, False, reason)


def estimate(value, sigma):
    return BiasEstimate(np.array(value), np.array(sigma), True)


def not_seen(reason):
    return BiasEstimate(np.full(3, np.nan), np.full(3, np.inf), False, reason)


def by_axis(name, unit, values, sigmas):
    return [
        parameter(f"{name} {axis}", unit, float(value), float(sigma))
        for axis, value, sigma in zip("xyz", values, sigmas, strict=True)
    ]


def rest(start, end, seed):
    random = np.random.default_rng(seed)
    force_sigma, rate_sigma = np.full(3, 8e-4), np.full(3, 8e-5)
    return Rest(
        start,
        end,
        round((end - start) * RATE_HZ),
        GRAVITY * UP + FORCE_BIAS + force_sigma * random.standard_normal(3),
        RATE_BIAS + rate_sigma * random.standard_normal(3),
        force_sigma,
        rate_sigma,
    )


def blocks(start, end, turned, seed):
    """Means over 0.2 s of a rest of 6 s, a turn of so many rad, and another rest."""
    random = np.random.default_rng(seed)
    time = np.arange(start + BLOCK / 2, end, BLOCK)
    turning = (time > start + 6.0) & (time < end - 6.0)
    rate = np.where(turning, turned / (BLOCK * turning.sum()), 0.0)
    heading = np.cumsum(rate) * BLOCK
    bearing = np.radians(UPHILL) - heading
    lever = -np.outer(rate**2, ARM)
    tilt = GRAVITY * np.sin(np.radians(TILT)) * np.column_stack([np.cos(bearing), np.sin(bearing)])
    fit = np.column_stack([tilt + lever[:, :2], np.full_like(time, GRAVITY * np.cos(np.radians(TILT)))])
    return SpinBlocks(
        time=time,
        resting=np.where(turning, 0.0, 1.0),
        heading=heading,
        rate=rate,
        across=5e-4 * random.standard_normal((len(time), 2)),
        force=fit + 0.005 * random.standard_normal(fit.shape),
        fit=fit,
    )


def spin(number=1, start=10.0, turned=6.0 * np.pi, off=0.0):
    """One level-free spin with all but the scales by direction shown; `off` sigmas from the others."""
    end = start + 12.0 + abs(turned)
    force, rate = FORCE_BIAS + off * FORCE_SIGMA, RATE_BIAS + off * RATE_SIGMA
    return Spin(
        label=f"spin {number}",
        start=start,
        end=end,
        rests=(rest(start, start + 6.0, number), rest(end - 6.0, end, number + 100)),
        turned_clockwise=0.0,
        turned_counter_clockwise=turned,
        heading_span=turned,
        rate=1.0,
        turning_time=37.7,
        method="level-free",
        gyroscope_bias=estimate(rate, RATE_SIGMA),
        level_free=estimate(force, FORCE_SIGMA),
        published=estimate(force + TILTED, 1.3 * FORCE_SIGMA),
        up=UP,
        parameters=(
            *by_axis("gyroscope bias", "rad/s", rate, RATE_SIGMA),
            *by_axis("accelerometer bias", "m/s^2", force, FORCE_SIGMA),
            parameter("mounting roll", "deg", 3.0021, 0.0043),
            parameter("mounting pitch", "deg", -2.0013, 0.0045),
            parameter("floor tilt", "deg", TILT, 0.0031),
            parameter("uphill bearing", "deg", UPHILL, 0.24),
            *by_axis("lever arm", "m", ARM, (0.0007, 0.0008, 0.00005)),
            parameter("gyroscope scale about the axis", "1", 1.0021, 0.0005),
            hidden("gyroscope scale clockwise", "1", NO_TRUTH),
            hidden("gyroscope scale counter-clockwise", "1", NO_TRUTH),
        ),
        slow_turn=parameter("slow turn at rest", "rad/s", 1.3e-4, 1.1e-4),
        chi_square=27.3,
        degrees_of_freedom=29,
        widening=1.0,
        covariance=np.diag(np.concatenate([FORCE_SIGMA, RATE_SIGMA]) ** 2),
        by_earth=np.zeros((3, 3)),
        noise=np.array([[0.02] * 3, [0.024] * 3, [0.002] * 3, [0.0022, 0.0025, 0.03]]),
        blocks=blocks(start, end, turned, number),
    )


def short_spin():
    """A spin of 60 deg: no level-free bias, no tilt, no lever arm."""
    whole = spin(turned=np.pi / 3)
    unseen = ("floor tilt", "uphill bearing", "lever arm", "gyroscope scale about")
    force = by_axis("accelerometer bias", "m/s^2", whole.published.value, whole.published.sigma)
    found = {each.name: each for each in force}
    return replace(
        whole,
        method="published",
        level_free=not_seen(NO_LEVEL_FREE),
        parameters=tuple(
            hidden(each.name, each.unit, NO_TILT)
            if each.name.startswith(unseen)
            else found.get(each.name, each)
            for each in whole.parameters
        ),
        warnings=("only 60 deg of a turn; turn once round or more",),
    )


def session(*spins, **changes):
    """A recording of these spins; of a good one where none is given."""
    spins = spins or (spin(),)
    one, share = len(spins) == 1, np.sqrt(len(spins))
    name = "chi-square of the spins against their mean"
    time = np.linspace(0.0, spins[-1].end + 5.0, 400)
    whole = SpinResult(
        name="robot_7",
        source="robot_7.csv",
        serial="IMU-0042",
        spins=spins,
        accelerometer_bias=spins[0].accelerometer_bias if one else estimate(FORCE_BIAS, FORCE_SIGMA / share),
        gyroscope_bias=spins[0].gyroscope_bias if one else estimate(RATE_BIAS, RATE_SIGMA / share),
        covariance=spins[0].covariance,
        agreement=hidden(name, "1", "with a single spin there is nothing to compare")
        if one
        else Parameter(name, "1", 7.97, 4.9, 4.4, 23.3),
        refused=((2.04, 5.13, "drove or was pushed: turned only 3 deg in 3.1 s"),),
        trace=Trace(time, np.tile(GRAVITY * UP + FORCE_BIAS, (400, 1)), np.tile(RATE_BIAS, (400, 1))),
        gravity=GRAVITY,
        gravity_source="standard",
        temperature=(24.1, 24.6, 25.2),
        options={"still": 2.0, "turns": None, "level-floor": False},
        warnings=("the clock of the log jumped by 0.4 s",),
        software="tumble 0.1.0",
    )
    return replace(whole, **changes)


def several():
    """Three spins that agree."""
    return session(spin(1), spin(2, 60.0, 4.0 * np.pi, 0.7), spin(3, 110.0, 2.0 * np.pi, -0.6))


def unobserved():
    """One spin that shows the bias of the gyroscope only."""
    reason = "the robot did not turn enough"
    short = short_spin()
    return session(
        replace(
            short,
            published=not_seen(reason),
            parameters=tuple(
                hidden(each.name, each.unit, reason) if each.name.startswith("accelerometer") else each
                for each in short.parameters
            ),
        )
    )
