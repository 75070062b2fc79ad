"""What holds for every test: Ctrl-C interrupts, wherever the tests were started from."""

import signal


def pytest_configure():
    # A shell starts what it puts in the background deaf to it, and children take that over.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
