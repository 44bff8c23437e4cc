"""Certificates of references, as files and as they are drawn."""

from datetime import date, timedelta

import numpy as np
import yaml

from tumble.calibration.reference_certificate import ReferenceCertificate
from tumble.foundation.provenance import date_now

GROUPS = ("bias", "scale", "non-orthogonality", "mounting")
IDEAL = {"bias": 0.0, "scale": 1.0, "non-orthogonality": 0.0, "mounting": 0.0}
U = {
    "accelerometer": {"bias": 2e-3, "scale": 4e-4, "non-orthogonality": 2e-2, "mounting": 3e-2},
    "gyroscope": {"bias": 2e-5, "scale": 1e-3, "non-orthogonality": 6e-2, "mounting": 5e-2},
}


def day(offset=0):
    """The day so many days after today."""
    return (date.fromisoformat(date_now()[:10]) + timedelta(days=offset)).isoformat()


def content(**changes):
    """A certificate of an ideal reference, half a year old, as its file holds it."""
    triads = {
        triad: {
            **{group: {"value": [IDEAL[group]] * 3, "U": size} for group, size in sizes.items()},
            "drift": {group: 0.5 * size for group, size in sizes.items()},
            "temperature": {"bias": 0.1 * sizes["bias"], "scale": 0.1 * sizes["scale"]},
        }
        for triad, sizes in U.items()
    }
    return {
        "schema": "tumble-reference-certificate/1",
        "reference": {"manufacturer": "Acme", "model": "R-9"},
        "laboratory": "Inertial metrology",
        "number": "2026-017",
        "date": day(-183),
        "due": day(182),
        "temperature": {"low": 22.0, "high": 24.0},
        **triads,
        **changes,
    }


def certificate(**changes):
    return ReferenceCertificate.model_validate(content(**changes))


def written(path, **changes):
    path.write_text(yaml.safe_dump(content(**changes)))
    return path


def lower_triangular(angles):
    """L of non-orthogonalities xy, yz, zx in rad, by the Cholesky factor of the axes' cosines."""
    xy, yz, zx = np.sin(angles)
    return np.linalg.cholesky(np.array([[1.0, xy, zx], [xy, 1.0, yz], [zx, yz, 1.0]]))


def turned(vector):
    """Rotation of a rotation vector, rad, by Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    cross = np.cross(np.eye(3), vector) if angle else np.zeros((3, 3))
    if not angle:
        return np.eye(3)
    return np.eye(3) - np.sin(angle) / angle * cross + (1.0 - np.cos(angle)) / angle**2 * cross @ cross
