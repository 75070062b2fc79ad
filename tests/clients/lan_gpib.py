"""The way of LIGO's scripts to an instrument: a Prologix on the network, replies to a character.

Written anew from what those scripts send (netgpib): EOT character 4, no automatic reading, EOI
alone at the end of a message, an interface clear, 3 s of patience.
"""

import socket
import time

EOT = b"\x04"


class LanGpib:
    """One instrument behind an adapter at a host and port."""

    def __init__(self, place, address):
        host, port = place.split(":")
        self._wire = socket.create_connection((host, int(port)), timeout=10.0)
        for line in (f"++addr {address}", "++eos 3", "++mode 1", "++auto 0", "++ifc",
                     "++read_tmo_ms 3000", "++eot_char 4", "++eot_enable 1",
                     f"++addr {address}", "++eoi 1"):  # fmt: skip
            self.command(line)

    def command(self, line):
        self._wire.sendall(f"{line}\n".encode())

    def query(self, line):
        self.command(line)
        self.command("++read eoi")
        return self._until_eot()

    def _until_eot(self):
        data = b""
        while not data.endswith(EOT):
            part = self._wire.recv(4096)
            assert part, "the adapter hung up"
            data += part
        return data[:-1]

    def text(self, line):
        return self.query(line).decode("latin-1").strip()

    def whole(self, line):
        return int(self.text(line))

    def poll(self):
        self.command("++spoll")
        return int(self._wire.recv(100))

    def until(self, done, within_s=60.0):
        end = time.monotonic() + within_s
        while not done():
            assert time.monotonic() < end, "it does not end"
            time.sleep(0.02)

    def close(self):
        self._wire.close()
