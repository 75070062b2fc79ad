"""A gateway that carries one connection to a served analyser, and refuses others meanwhile."""

import socket
import threading
from contextlib import contextmanager, suppress


@contextmanager
def one_at_a_time(url):
    """A gateway that serves one connection, and refuses others while that one lasts."""
    _, host, port, _ = url.split("::")
    over = threading.Event()

    def pump(one, other):
        with suppress(OSError):
            while data := one.recv(4096):
                other.sendall(data)
        for end in (one, other):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def carry(client):
        with client, socket.create_connection((host, int(port))) as behind:
            back = threading.Thread(target=pump, args=(behind, client))
            back.start()
            pump(client, behind)
            back.join()

    def serve(gate):
        busy = None
        while not over.is_set():
            with suppress(TimeoutError):
                client, _ = gate.accept()
                if busy is not None and busy.is_alive():
                    client.close()
                    continue
                client.settimeout(None)
                busy = threading.Thread(target=carry, args=(client,))
                busy.start()
        if busy is not None:
            busy.join()

    with socket.create_server(("127.0.0.1", 0)) as gate:
        gate.settimeout(0.1)
        thread = threading.Thread(target=serve, args=(gate,))
        thread.start()
        try:
            yield f"TCPIP::127.0.0.1::{gate.getsockname()[1]}::SOCKET"
        finally:
            over.set()
            thread.join()
