"""Tests replace nothing of ours: what is left of such patches may only get fewer."""

from pathlib import Path

import pytest
from rules.own_names import found_in, patches, private_names

LEFT = {patches: 34, private_names: 15}
"""Of 174 and 69 once. Lower the number with every one that goes; put none in its place."""


@pytest.mark.parametrize("look", LEFT, ids=lambda look: look.__name__)
def test_program_is_patched_no_more_than_counted(look):
    found = found_in(Path(__file__).parents[1], look)
    assert len(found) <= LEFT[look], "\n".join(found)


def test_own_names_are_distinguished_from_foreign():
    source = """
import os
import numpy as np
from analysis import diagnosis
from daq.store import Store, file as kept
from sim.unit import _load

class Fake:
    def __init__(self):
        self._mine = 1

def test(monkeypatch, store, name):
    monkeypatch.setattr(diagnosis, "refine", None)
    monkeypatch.setattr(Store, "close", None)
    monkeypatch.setattr("daq.store.file.BUSY_S", 0.1)
    monkeypatch.setattr(f"daq.formats.{name}.read", None)
    monkeypatch.setattr(np.linalg, "inv", None)
    monkeypatch.setattr(os, "getgroups", list)
    monkeypatch.setattr("os.getgroups", list)
    monkeypatch.setenv("HOME", "/")
    store._writer.close()
    kept._BUSY_S
    Fake()._mine
"""
    assert [line for line, _ in patches(source)] == [13, 14, 15, 16]
    assert sorted(text for _, text in private_names(source)) == [
        "kept._BUSY_S", "sim.unit._load", "store._writer"
    ]  # fmt: skip
