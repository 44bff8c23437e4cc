"""Two IMUs that send over UDP, read at once beside other tasks of asyncio, on one clock.

python examples/05_live_units.py

The units are made up here; of real ones only the addresses differ, such as `serial:/dev/ttyUSB0?baud=921600`.
"""

from __future__ import annotations

import asyncio
import json
import socket

import numpy as np

from tumble.live import LiveSet, open_set

PORTS = {"left": 9101, "right": 9102}
RATE, SECONDS = 200.0, 3.0
BOOTED = {"left": 12.5, "right": 8000.0}
"""s that each unit's own clock shows at the start."""


async def send(name: str, port: int) -> None:
    """Sends as a unit would: JSON, a datagram a sample, stamped by a clock of its own."""
    generator = np.random.default_rng(port)
    loop = asyncio.get_running_loop()
    began = loop.time()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        for number in range(int(RATE * SECONDS)):
            await asyncio.sleep(max(0.0, began + number / RATE - loop.time()))
            x, y, z, roll, pitch, yaw = 0.01 * generator.standard_normal(6)
            sample = {"t": BOOTED[name] + number / RATE, "ax": x, "ay": y, "az": 9.80665 + z}
            sample |= {"gx_rad/s": 0.1 * roll, "gy_rad/s": 0.1 * pitch, "gz_rad/s": 0.1 * yaw}
            line.sendto(json.dumps(sample).encode(), ("127.0.0.1", port))


async def watch(units: LiveSet) -> dict[str, int]:
    """Counts samples until each unit has sent for two seconds; times of all are on this computer's clock."""
    counts = dict.fromkeys(PORTS, 0)
    async for name, chunk in units:
        counts[name] += len(chunk)
        if min(counts.values()) >= RATE * 2.0:
            break
    return counts


async def run(units: LiveSet) -> None:
    """Watches while both send."""
    senders = [asyncio.create_task(send(name, port)) for name, port in PORTS.items()]
    counts = await watch(units)
    for name, count in counts.items():
        timing = units.timing[name]
        print(f"{name}: {count} samples, {1.0 / timing.interval:.0f} Hz, {timing.gaps} gaps")
        for remark in units.remarks[name]:
            print(f"  {remark}")
    await asyncio.gather(*senders)


def main() -> None:
    """Reads two units live."""
    with open_set([f"{name}=udp://127.0.0.1:{port}" for name, port in PORTS.items()]) as units:
        asyncio.run(run(units))


if __name__ == "__main__":
    main()
