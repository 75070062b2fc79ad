"""The IEEE 488.2 status model: registers, enables, summary bits, service request.

Owns every status bit of the instrument and how one leads to another. It does
not know why a bit changes.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntFlag

__all__ = ["ALL_BITS", "Device", "Event", "Operation", "Questionable", "Register", "StatusModel"]

ALL_BITS = 0x7FFF


class Event(IntFlag):
    """Standard Event register."""

    OPERATION_COMPLETE = 1
    REQUEST_CONTROL = 2
    QUERY = 4
    DEVICE = 8
    EXECUTION = 16
    COMMAND = 32
    POWER_ON = 128


class Operation(IntFlag):
    """Operation register; there is no bit for sweeping."""

    CALIBRATING = 1
    SETTLING = 2
    RANGING = 4
    MEASURING = 16
    WAITING_FOR_TRIGGER = 32
    WAITING_FOR_ARM = 64
    AVERAGING = 256


class Questionable(IntFlag):
    """Questionable register."""

    VOLTAGE = 1
    CALIBRATION_FAILED = 256
    LIMIT_FAIL = 512


class Device(IntFlag):
    """Device State register."""

    AUTOCALIBRATION_OFF = 1
    HARDWARE_FAILED = 4
    DISPLAY_READY = 32


class Register:
    """Condition, transition filters, event and enable of one set."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self.condition = 0
        self.positive = ALL_BITS
        self.negative = 0
        self.event = 0
        self._enable = 0

    @property
    def enable(self) -> int:
        """Bits of the event register that make up the summary."""
        return self._enable

    @enable.setter
    def enable(self, bits: int) -> None:
        self._enable = bits
        self._changed()

    @property
    def summary(self) -> bool:
        """Whether an enabled event is set."""
        return bool(self.event & self._enable)

    def put(self, bits: int, on: bool) -> None:
        """Set or clear condition bits; transitions pass the filters into the event register."""
        before = self.condition
        self.condition = before | bits if on else before & ~bits
        rises = self.condition & ~before & self.positive
        falls = before & ~self.condition & self.negative
        if rises or falls:
            self.event |= rises | falls
            self._changed()

    def pulse(self, bits: int) -> None:
        """Raise events that have no condition."""
        self.event |= bits & self.positive
        self._changed()

    def take_event(self) -> int:
        """Read and clear the event register."""
        value, self.event = self.event, 0
        self._changed()
        return value

    def preset_filters(self) -> None:
        """All positive transitions pass, no negative one."""
        self.positive, self.negative = ALL_BITS, 0


class StatusModel:
    """All register sets, the status byte and the service request."""

    def __init__(self) -> None:
        self.operation = Register(self.update)
        self.questionable = Register(self.update)
        self.voltage = Register(self._voltage_changed)
        self.limit = Register(self._limit_changed)
        self.device = Register(self.update)
        self.user = Register(self.update)
        self.standard_event = 0
        self._event_enable = 0
        self._request_enable = 0
        self.power_on_clear = True
        self._message_available = False
        self._reasons = 0
        self.requesting = False

    def _voltage_changed(self) -> None:
        self.questionable.put(Questionable.VOLTAGE, self.voltage.summary)
        self.update()

    def _limit_changed(self) -> None:
        self.questionable.put(Questionable.LIMIT_FAIL, self.limit.summary)
        self.update()

    @property
    def registers(self) -> tuple[Register, ...]:
        """Every set with filters."""
        return (
            self.operation,
            self.questionable,
            self.voltage,
            self.limit,
            self.device,
            self.user,
        )

    def raise_event(self, bits: int) -> None:
        """Set bits of the Standard Event register."""
        self.standard_event |= bits
        self.update()

    def take_standard_event(self) -> int:
        """``*ESR?``: read and clear."""
        value, self.standard_event = self.standard_event, 0
        self.update()
        return value

    @property
    def event_enable(self) -> int:
        """``*ESE``."""
        return self._event_enable

    @event_enable.setter
    def event_enable(self, bits: int) -> None:
        self._event_enable = bits
        self.update()

    @property
    def request_enable(self) -> int:
        """``*SRE``; bit 6 is ignored."""
        return self._request_enable

    @request_enable.setter
    def request_enable(self, bits: int) -> None:
        self._request_enable = bits & ~64
        self.update()

    def set_message_available(self, on: bool) -> None:
        """Follow the output queue."""
        if on != self._message_available:
            self._message_available = on
            self.update()

    @property
    def summary_bits(self) -> int:
        """The status byte without bit 6."""
        parts = (
            self.user.summary,
            False,
            self.device.summary,
            self.questionable.summary,
            self._message_available,
            bool(self.standard_event & self._event_enable),
            False,
            self.operation.summary,
        )
        return sum(1 << bit for bit, on in enumerate(parts) if on)

    @property
    def status_byte(self) -> int:
        """``*STB?``: with MSS in bit 6; clears nothing."""
        bits = self.summary_bits
        return bits | (64 if bits & self._request_enable else 0)

    def serial_poll(self) -> int:
        """The byte of a serial poll: with RQS in bit 6, which it clears."""
        value = self.summary_bits | (64 if self.requesting else 0)
        self.requesting = False
        return value

    def update(self) -> None:
        """Raise the service request on a new reason; let it fall when no reason is left."""
        reasons = self.summary_bits & self._request_enable
        if reasons & ~self._reasons:
            self.requesting = True
        if not reasons:
            self.requesting = False
        self._reasons = reasons

    def clear(self) -> None:
        """``*CLS``: all event registers; enables and filters stay."""
        self.standard_event = 0
        for register in self.registers:
            register.event = 0
        self._voltage_changed()
        self._limit_changed()
        self.questionable.event = 0
        self.update()

    def preset(self) -> None:
        """``STAT:PRES``."""
        for register in (self.device, self.questionable, self.operation):
            register.preset_filters()
            register.enable = 0
        self.user.enable = 0
        for register in (self.voltage, self.limit):
            register.preset_filters()
            # [S] The manual says all ones in one place, zero in another.
            register.enable = ALL_BITS

    def power_on(self) -> None:
        """Come up after a power cycle; ``*ESE`` and ``*SRE`` live on unless ``*PSC`` is set."""
        for register in self.registers:
            register.condition = register.event = 0
        self.preset()
        self.standard_event = 0
        if self.power_on_clear:
            self._event_enable = self._request_enable = 0
        self._reasons = 0
        self.requesting = False
        self.raise_event(Event.POWER_ON)
