"""No package imports in a circle, but for those that are known."""

import grimp
import pytest

PACKAGES = ("daq", "sim", "analysis", "tui", "lashbench")
KNOWN = {
    # Parts of one instrument, or of one application, that know the whole.
    "sim.sr785.instrument": {"sim.sr785"},
    "sim.analyser35670a.instrument": {"sim.analyser35670a"},
    "tui.app.application": {"tui.app", "tui.commands.bench", "tui.cli", "tui.entry"},
}
"""A module of each circle, and in which modules and rooms the others are."""


def circles(imported):
    """Sets of modules that import each other, from what each imports (Tarjan, SIAM J. 1972)."""
    index, low, stack, found = {}, {}, [], []

    def visit(module):
        index[module] = low[module] = len(index)
        stack.append(module)
        for other in imported[module]:
            if other not in index:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], index[other])
        if low[module] == index[module]:
            place = stack.index(module)
            if len(stack) > place + 1:
                found.append(set(stack[place:]))
            del stack[place:]

    for module in imported:
        if module not in index:
            visit(module)
    return found


@pytest.fixture(scope="module")
def imported():
    """What each module imports, for types and within functions, too."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    return {one: graph.find_modules_directly_imported_by(one) for one in sorted(graph.modules)}


def test_no_modules_import_in_a_circle_but_those_that_are_known(imported):
    known = dict(KNOWN)
    for circle in circles(imported):
        (name,) = circle & set(KNOWN) or {"none of the known circles"}
        rooms = known.pop(name, set()) | {name}
        beside = [one for one in circle if not any(f"{one}.".startswith(f"{r}.") for r in rooms)]
        assert beside == [], f"{name}: {sorted(circle)}"
    assert not known, "no circle any more: take it off the list"


def test_a_circle_is_found():
    straight = {"a": {"b", "c"}, "b": {"c"}, "c": set()}
    assert circles(straight) == []
    assert circles(straight | {"c": {"a"}}) == [{"a", "b", "c"}]
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == [{"b", "c"}]
