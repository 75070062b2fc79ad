"""Which device a USB adapter is at, also after it came back under another name."""

import os

import pytest
from serial.tools.list_ports_common import ListPortInfo

from daq.transports.ports import PortBook


class Machine:
    """Serial devices that are plugged in and out; the lasting links are those of udev."""

    def __init__(self, folder, links=True):
        self.folder = folder
        self.by_id = folder / "by-id"
        if links:
            self.by_id.mkdir()
        self._listed = {}

    def plug(self, number, name="usb-A", usb=(0x0403, 0x6001, "PX8X3YR6")):
        device = self.folder / f"ttyUSB{number}"
        device.write_text(name)
        info = ListPortInfo(str(device))
        info.vid, info.pid, info.serial_number = usb
        self._listed[number] = info
        if self.by_id.is_dir() and name:
            link = self.by_id / name
            link.unlink(missing_ok=True)
            link.symlink_to(os.path.join("..", device.name))
        return str(device)

    def pull(self, number):
        (self.folder / f"ttyUSB{number}").unlink()
        del self._listed[number]

    def book(self):
        return PortBook(self.by_id, lambda: list(self._listed.values()))


@pytest.fixture
def machine(tmp_path):
    return Machine(tmp_path)


def test_unmoved_adapter_keeps_its_port(machine):
    book, device = machine.book(), machine.plug(0)
    assert book.now(device) == device
    book.note(device)
    assert book.now(device) == device


def test_the_lasting_link_is_followed(machine):
    book, device = machine.book(), machine.plug(0)
    book.note(device)
    machine.pull(0)
    assert book.now(device) == device
    machine.plug(1)
    assert os.path.realpath(book.now(device)) == str(machine.folder / "ttyUSB1")


def test_adapter_is_found_by_usb_serial_number(tmp_path):
    """Where the system offers no lasting links."""
    machine = Machine(tmp_path, links=False)
    book, device = machine.book(), machine.plug(0)
    other = machine.plug(1, usb=(0x0403, 0x6001, "OTHER"))
    book.note(device)
    machine.pull(0)
    assert book.now(device) == device
    assert machine.plug(2) == book.now(device) != other


def test_other_adapter_under_old_name_is_rejected(machine):
    book, device = machine.book(), machine.plug(0)
    book.note(device)
    machine.pull(0)
    machine.plug(0, "usb-B", (0x2341, 0x0043, "OTHER"))
    machine.plug(1)
    assert os.path.realpath(book.now(device)) == str(machine.folder / "ttyUSB1")


def test_alike_adapters_without_number_are_not_guessed(tmp_path):
    machine = Machine(tmp_path, links=False)
    clone = (0x1A86, 0x7523, "")
    book, device = machine.book(), machine.plug(0, usb=clone)
    book.note(device)
    machine.pull(0)
    machine.plug(1, usb=clone)
    assert book.now(device) == str(machine.folder / "ttyUSB1")
    machine.plug(2, usb=clone)
    assert book.now(device) == device


def test_lasting_port_name_is_offered_if_available(machine):
    book, device = machine.book(), machine.plug(0)
    assert book.lasting(device) == str(machine.by_id / "usb-A")
    assert book.lasting(str(machine.by_id / "usb-A")) is None
    assert book.lasting("socket://127.0.0.1:1234") is None
    assert book.lasting(str(machine.folder / "ttyUSB7")) is None
