"""Which sensors are plugged in, and whether this user may read them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from tumble.tools.doctor.result import Diagnosed, State

SERIAL_NAMES = ("ttyUSB*", "ttyACM*", "ttyAMA*", "cu.usb*")
"""Names of ports in `/dev`, where pyserial is not installed to list them."""


def serial_ports(root: Path) -> Iterator[Diagnosed]:
    """Inspects each serial port; `root` is the folder that holds `dev`."""
    from tumble.live.transport import GET_PERMISSION

    ports = _listed() if root == Path(root.anchor) else _seen(root)
    for port in ports:
        # Windows gives no rights to ports.
        if os.name == "nt" or os.access(port, os.R_OK | os.W_OK):
            yield Diagnosed(port, State.WORKS, "may be read and written")
        else:
            yield Diagnosed(port, State.REFUSED, "no permission to read and write it", GET_PERMISSION)
    if not ports:
        yield Diagnosed("serial ports", State.MISSING, "none plugged in")


def _listed() -> list[str]:
    """Lists the ports of this machine, by pyserial where it is installed."""
    try:
        known = import_module("serial.tools.list_ports").comports()
    except ImportError:
        return _seen(Path("/"))
    return sorted(str(port.device) for port in known)


def _seen(root: Path) -> list[str]:
    return sorted(str(path) for name in SERIAL_NAMES for path in (root / "dev").glob(name))


def iio_devices(root: Path) -> Iterator[Diagnosed]:
    """Inspects each sensor that Linux drives itself; `root` is the folder that holds `sys` and `dev`."""
    from tumble.live.iio_device import GET_PERMISSION, device_folders

    folders = device_folders(root)
    for folder in folders:
        node = root / "dev" / folder.name
        switches = sorted(folder.glob("buffer*/enable"))
        if not switches:
            yield Diagnosed(folder.name, State.BROKEN, "its driver has no buffer, so that it cannot be read")
        elif os.access(node, os.R_OK) and all(os.access(each, os.W_OK) for each in switches):
            yield Diagnosed(folder.name, State.WORKS, "may be captured from")
        else:
            yield Diagnosed(folder.name, State.REFUSED, f"no permission to use {node}", GET_PERMISSION)
    if not folders:
        yield Diagnosed("IIO devices", State.MISSING, "none; only Linux has them, where a driver is loaded")
