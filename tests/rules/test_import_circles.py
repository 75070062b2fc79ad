"""No modules import in a circle, not even for types or within functions."""

import grimp
import pytest

PACKAGES = ("daq", "sim", "analysis", "tui", "lashbench")


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


def test_no_modules_import_in_a_circle(imported):
    assert [sorted(circle) for circle in circles(imported)] == []


def test_a_circle_is_found():
    straight = {"a": {"b", "c"}, "b": {"c"}, "c": set()}
    assert circles(straight) == []
    assert circles(straight | {"c": {"a"}}) == [{"a", "b", "c"}]
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == [{"b", "c"}]
