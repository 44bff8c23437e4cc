"""Asking an autopilot to send a message more often, and to go back to its own rate afterwards."""

from __future__ import annotations

from typing import Any

from tumble.foundation.errors import LogError
from tumble.live.address import Address
from tumble.live.transport import Transport

GROUND_STATION, MISSION_PLANNER = 255, 190
"""System and component that ground stations call themselves."""
ITS_OWN_RATE = 0
"""Interval that stands for the one the autopilot would choose itself."""


class MessageRequest:
    """Asks the first autopilot that announces itself, of system `system` if that is not 0.

    `dialect` is pymavlink's, `rate` in Hz.
    """

    def __init__(
        self,
        address: Address,
        dialect: Any,  # noqa: ANN401
        message: str,
        system: int,
        rate: float,
    ) -> None:
        self._address = address
        self._dialect = dialect
        self._message = message
        self._system = system
        self._number = getattr(dialect, f"MAVLINK_MSG_ID_{message}")
        self._interval = round(1e6 / rate)
        self._sender = dialect.MAVLink(None, srcSystem=GROUND_STATION, srcComponent=MISSION_PLANNER)
        self._asked: tuple[int, int] | None = None

    def handle(self, message: Any, transport: Transport) -> None:  # noqa: ANN401
        """Handles a message: asks the sender of a heartbeat; raises `LogError` where it refuses."""
        if self._asked is None and self._is_wanted(message):
            self._asked = message.get_srcSystem(), message.get_srcComponent()
            transport.send(self._command(self._interval))
        elif self._is_refusal(message):
            raise LogError(
                f"{self._address.text}: the autopilot will not send {self._message} at that rate (result "
                f"{message.result}); ask for another one, as ?message=SCALED_IMU, or leave out ?rate="
            )

    def _is_wanted(self, message: Any) -> bool:  # noqa: ANN401
        """Returns whether it is the heartbeat of an autopilot: ground stations have one too."""
        return (
            message.get_type() == "HEARTBEAT"
            and message.autopilot != self._dialect.MAV_AUTOPILOT_INVALID
            and self._system in (0, message.get_srcSystem())
        )

    def _is_refusal(self, message: Any) -> bool:  # noqa: ANN401
        good = self._dialect.MAV_RESULT_ACCEPTED, self._dialect.MAV_RESULT_IN_PROGRESS
        return (
            message.get_type() == "COMMAND_ACK"
            and message.command == self._dialect.MAV_CMD_SET_MESSAGE_INTERVAL
            and message.result not in good
        )

    def restore_rate(self, transport: Transport) -> None:
        """Restores the autopilot's own rate, if another one was requested."""
        if self._asked is not None:
            transport.send(self._command(ITS_OWN_RATE))

    def _command(self, interval: int) -> bytes:
        assert self._asked is not None, "a command goes to an autopilot that was heard"
        command = self._dialect.MAVLink_command_long_message(
            *self._asked,
            self._dialect.MAV_CMD_SET_MESSAGE_INTERVAL,
            0,
            self._number,
            interval,
            *[0] * 5,
        )
        packed: bytes = command.pack(self._sender)
        return packed
