"""A device of known gain behind the simulated analyser's inputs."""

from __future__ import annotations

from sim.analyser35670a import LinearPlant

__all__ = ["Recording", "known_answer"]


def known_answer(hz: float) -> complex:
    """The gain of the device: a tenth, turning with frequency."""
    return 0.1 * (1.0 + 1j * hz / 100.0)


class Recording:
    """A plant that notes how it was driven."""

    def __init__(self, response=known_answer) -> None:
        self._plant = LinearPlant(response)
        self.calls: list[tuple[float, float, float, int, int]] = []

    def dwell(self, *call):
        self.calls.append(call)
        return self._plant.dwell(*call)

    @property
    def frequencies(self) -> list[float]:
        return [call[0] for call in self.calls]
