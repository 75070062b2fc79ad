"""What a client and a simulated instrument say to each other, as text.

Wraps an instrument and changes nothing of it. An exchange that repeats stands once, with its
number; long replies are cut. The transcripts are kept in docs/clients, and compared.
"""

from pathlib import Path

from sim.instrument.bus import TalkState

KEPT = Path(__file__).parents[2] / "docs" / "transcripts"
_LONGEST = 68


class Heard:
    """An instrument whose bus is listened to."""

    def __init__(self, instrument):
        object.__setattr__(self, "_instrument", instrument)
        object.__setattr__(self, "_line", bytearray())
        object.__setattr__(self, "_reply", bytearray())
        object.__setattr__(self, "exchanges", [])

    def __getattr__(self, name):
        return getattr(self._instrument, name)

    def __setattr__(self, name, value):
        setattr(self._instrument, name, value)

    def listen(self, data, end=False):
        taken = self._instrument.listen(data, end)
        self._line.extend(data[:taken])
        whole = end and taken == len(data)
        while b"\n" in self._line or (whole and self._line):
            line, _, rest = bytes(self._line).partition(b"\n")
            self._line[:] = rest
            self._flush()
            if line.strip():
                self.exchanges.append(f"> {shown(line)}")
        return taken

    def talk(self, limit=None):
        talk = self._instrument.talk(limit)
        if talk.state is TalkState.DATA:
            self._reply.extend(talk.data)
            if talk.end:
                self._flush()
        return talk

    def serial_poll(self):
        byte = self._instrument.serial_poll()
        self.exchanges.append(f"  serial poll: {byte}")
        return byte

    def device_clear(self):
        self.exchanges.append("  device clear")
        self._instrument.device_clear()

    def _flush(self):
        if self._reply:
            self.exchanges.append(f"< {shown(self._reply)}")
            self._reply.clear()

    def lines(self):
        """The dialogue; what repeats stands once."""
        self._flush()
        lines, at = [], 0
        while at < len(self.exchanges):
            for length in range(2, 7):
                part = self.exchanges[at : at + length]
                kind = [_alike(one) for one in part]
                times = 1
                while [
                    _alike(one)
                    for one in self.exchanges[at + times * length : at + (times + 1) * length]
                ] == kind:
                    times += 1
                if times > 2 and part[0].startswith(">"):
                    break
            else:
                part, times, length = self.exchanges[at : at + 1], 1, 1
            lines += part
            if times > 1:
                lines.append(f"  ... the last {length} lines {times} times in all")
            at += times * length
        return lines


def _alike(line):
    """An exchange without its numbers; replies are all alike."""
    if line.startswith("<"):
        return "<"
    return "".join("#" if c.isdigit() else c for c in line)


def shown(data):
    """Bytes as a line of text."""
    text = bytes(data).rstrip(b"\r\n").decode("latin-1").encode("unicode_escape").decode("ascii")
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}... ({len(data)} bytes)"


def commands(lines):
    """What a client says, each command once."""
    return list(dict.fromkeys(_alike(one) for one in lines if one.startswith(">")))
