"""The search for pairs, in a world whose answers are known."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic_search

from analysis import pairs, search
from analysis.purse import Purse
from analysis.screening import Place
from sim.catalogue import CATALOGUE
from sim.effort import Effort

RNG = np.random.default_rng(1)


@pytest.mark.parametrize("seed", synthetic_search.MORE_SEEDS)
def test_two_causes_are_found_together(runs, seed):
    pair = ("amplifier-lag", "load-inertia")
    _, verdict = synthetic_search.diagnosed(pair, [0.8, 0.3], seed)
    assert (verdict.word, verdict.best.effects) == ("explained", pair)


@pytest.mark.parametrize("seed", synthetic_search.MORE_SEEDS)
def test_a_pair_that_the_coarse_look_passes_over_is_found_beside_one_of_its_causes(
    runs, monkeypatch, seed
):
    pair = ("amplifier-lag", "load-inertia")

    def blind_to_it(*given):
        places = screen_pairs(*given)
        return {key: place for key, place in places.items() if key != pair}

    screen_pairs = pairs.screen_pairs
    monkeypatch.setattr(pairs, "screen_pairs", blind_to_it)
    # Nor by way of sets of three, whose parts are looked at, too.
    monkeypatch.setattr(search, "_TRIPLES", 0)
    _, verdict = synthetic_search.diagnosed(pair, [0.8, 0.3], seed)
    assert (verdict.word, verdict.best.effects) == ("explained", pair)


def test_a_pair_is_found_where_there_are_no_others_to_hold_it_against(runs):
    pair = ("amplifier-lag", "load-inertia")
    _, verdict = synthetic_search.diagnosed(pair, [0.8, 0.3], 1, without=set(CATALOGUE) - set(pair))
    assert (verdict.word, verdict.best.effects) == ("explained", pair)


class Standings:
    """A hunt that has looked at hypotheses already, of these log-likelihoods."""

    unit, observation = None, "as heard at first"

    def __init__(self, likelihood):
        self.found = {
            key: SimpleNamespace(
                of=key, best=SimpleNamespace(log_likelihood=value, place=f"where {key} is")
            )
            for key, value in likelihood.items()
        }

    @property
    def best_single(self):
        return self.among([key for key in self.found if len(key) == 1])[0]

    def among(self, keys):
        ranked = sorted(self.found, key=lambda key: -self.found[key].best.log_likelihood)
        return [key for key in ranked if key in keys]

    def leading(self, most):
        return self.among(self.found)[:most]


@pytest.mark.parametrize(
    ("part", "brought_in", "swapped", "weighed"),
    [
        # One of the leader's causes does as well alone: it is the one that is known.
        (95.0, [("a", "c")], [("a",)], [("a", "b")]),
        # What is tried beside them does no better.
        (60.0, [("a", "c"), ("b", "d")], [("a",), ("b",)], [("a", "b")]),
        # One does, and its causes are looked at alone, too.
        (60.0, [("a", "e"), ("b", "d")], [("a",), ("b",)], [("a", "b"), ("a", "e")]),
    ],
)
def test_others_are_tried_beside_the_causes_of_a_leading_pair(
    monkeypatch, part, brought_in, swapped, weighed
):
    likelihood = {("a", "b"): 100.0, ("a", "c"): 90.0, ("a", "e"): 200.0, ("b", "d"): 80.0}
    likelihood |= {(): 0.0}
    likelihood |= {(cause,): part for cause in "abcdef"}
    # Of a leader with one cause that does as well alone, nothing else is close to that.
    likelihood |= {(cause,): part - 61.0 for cause in "bcdef" if part == 95.0}
    beside, alone = [], []

    def look(rough, additions, kept):
        beside.extend(kept)
        return set(brought_in)

    monkeypatch.setattr(pairs, "look_beside_all", look)
    monkeypatch.setattr(pairs, "places_of_parts", lambda leader: {(e,): None for e in leader.of})
    monkeypatch.setattr(pairs, "look_at_parts", lambda rough, leader: alone.append(leader))
    additions = SimpleNamespace(coarse=Standings.observation)
    looked_at = {("a", "b"), ("a", "c")}
    pairs._hold_against_neighbours(Standings(likelihood), {}, additions, looked_at, RNG)
    assert (beside, alone) == (swapped, weighed)


@pytest.mark.parametrize(
    ("behind", "doubted", "held"),
    [(59.0, True, True), (61.0, True, False), (59.0, False, False)],
)
def test_others_are_tried_beside_a_close_pair_that_shares_no_cause_with_a_leader_in_doubt(
    monkeypatch, behind, doubted, held
):
    leader, stranger, far = ("a", "b"), ("c", "d"), ("e", "f")
    likelihood = {leader: 100.0, ("a", "c"): 99.0, stranger: 100.0 - behind, far: 100.0 - behind}
    rough = Standings(likelihood | {(cause,): 0.0 for cause in "abcdef"})
    beside, alone = [], []
    monkeypatch.setattr(
        pairs, "look_beside_all", lambda r, a, kept: beside.extend(kept) or {leader}
    )
    monkeypatch.setattr(pairs, "places_of_parts", lambda leader: {(e,): None for e in leader.of})
    monkeypatch.setattr(pairs, "look_at_parts", lambda rough, leader: alone.append(leader))
    additions = SimpleNamespace(coarse=Standings.observation)
    monkeypatch.setattr(pairs, "is_doubtful", lambda one, rng, missed: doubted and missed == 1.3)
    looked_at = {leader, ("a", "c"), stranger, far}
    pairs._hold_against_neighbours(rough, {}, additions, looked_at, RNG)
    assert beside == [("a",), ("b",), *([("c",), ("d",)] if held else [])]
    assert alone == [leader, *([stranger] if held else [])]


@pytest.mark.parametrize(
    ("ahead", "pair", "kept"),
    [
        (199.0, ("a", "b"), [("a",), ("b",)]),
        (201.0, ("a", "b"), [("a",)]),
        # The leading pair has nothing to do with it.
        (201.0, ("b", "c"), [("b",), ("c",)]),
    ],
)
def test_nothing_is_tried_beside_what_a_single_cause_leads_by_far(monkeypatch, ahead, pair, kept):
    singles = {("a",): 500.0, ("b",): 100.0, ("c",): 500.0 - ahead}
    monkeypatch.setattr(pairs, "places_of_parts", lambda leader: {(e,): None for e in leader.of})
    assert list(pairs._kept(Standings({pair: 900.0} | singles), pair)) == kept


@pytest.mark.parametrize(("behind", "kept"), [(59.0, [("a",), ("c",)]), (61.0, [("a",)])])
def test_beside_a_single_cause_that_does_as_well_the_next_is_kept_if_it_is_close(behind, kept):
    """A weak motor may stand for a weak amplifier with something else."""
    singles = {("a",): 100.0, ("b",): 0.0, ("c",): 100.0 - behind, ("d",): 39.0}
    rough = Standings({("a", "b"): 101.0, ("a", "c"): 99.0} | singles)
    places = pairs._kept(rough, ("a", "b"))
    assert list(places) == kept
    assert all(places[key] == rough.found[key].best.place for key in kept)


@pytest.mark.parametrize(("heard_anew", "added_up"), [([False, False], 0), ([True, False], 1)])
def test_what_causes_add_is_looked_at_again_where_another_noise_was_heard(
    monkeypatch, heard_anew, added_up
):
    rough = Standings({("a", "b"): 100.0, ("a", "e"): 200.0, ("a",): 60.0, ("b",): 60.0})
    first, anew, used, heard = SimpleNamespace(coarse=rough.observation), [], [], iter(heard_anew)

    def look(rough, leader):
        if next(heard, False):
            rough.observation = "as heard since"

    def add(unit, coarse, atlas):
        anew.append(SimpleNamespace(coarse=coarse))
        return anew[-1]

    def beside(rough, additions, kept):
        used.append(additions)
        return {("a", "e")}

    monkeypatch.setattr(pairs, "look_at_parts", look)
    monkeypatch.setattr(pairs, "add_causes", add)
    monkeypatch.setattr(pairs, "look_beside_all", beside)
    monkeypatch.setattr(pairs, "places_of_parts", lambda leader: {(e,): None for e in leader.of})
    pairs._hold_against_neighbours(rough, {}, first, {("a", "b")}, RNG)
    assert len(anew) == added_up
    assert used == [anew[0] if added_up else first]


class Rough:
    """A hunt on few rows that tells what was looked at beside which causes, and how.

    Who has the greater name does better, by so much for each that comes before it.
    """

    observation = None
    spared = False
    apart = 50.0

    def __init__(self, monkeypatch, placed, purse=None, costs=lambda: None, lent=None):
        self.found = {part: SimpleNamespace(hypothesis=part) for part in placed}
        self.looks, self.purse = [], Purse() if purse is None else purse

        def place(few, additions, known, at):
            assert (few, at) == ("few", f"where {known} is")
            return placed[known]

        def look(name):
            def record(rough, what):
                self.looks.append((name, what))
                for key in what:
                    self.found.setdefault(key, SimpleNamespace())
                self.rank()
                costs()

            return record

        def lead(rough, additions, part, keys):
            assert all(set(key) > set(part) for key in keys)
            return {key: (lent or {}).get((part, key), 5.0) for key in keys}

        monkeypatch.setattr(pairs, "coarse_stride", lambda *_: 2)
        monkeypatch.setattr(pairs, "place_beside", place)
        monkeypatch.setattr(pairs, "leads_with_lent", lead)
        for name in ("look_beside", "look_closer_beside"):
            monkeypatch.setattr(pairs, name, look(name))

    def thinned(self, stride):
        return "few"

    def rank(self):
        for i, key in enumerate(sorted(self.found, reverse=True)):
            self.found[key].best = SimpleNamespace(log_likelihood=-self.apart * i)

    def among(self, keys):
        return sorted(keys, reverse=True)

    def hear(self):
        self.looks.append(("hear", None))

    def look_beside_all(self):
        return pairs.look_beside_all(self, None, {part: f"where {part} is" for part in self.found})


def test_all_that_is_not_hopeless_is_looked_at_where_it_was_placed_the_likeliest_first(monkeypatch):
    """Whichever cause it stands beside, and at both places if it was placed beside both.

    Six at a time, and six of them closer.
    """
    beside_a = {("a", f"x{i}"): Place(f"near x{i}", -12.0 * i) for i in range(11)}
    beside_b = {("b", "y"): Place("near y", -5.0), ("b", "z"): Place("near z", -97.0)}
    both = {"a": Place("as a has it", -40.0), "b": Place("as b has it", -30.0)}
    rough = Rough(
        monkeypatch,
        {("a",): beside_a | {("a", "b"): both["a"]}, ("b",): beside_b | {("a", "b"): both["b"]}},
    )
    closer = rough.look_beside_all()
    first, again, then, *rest = rough.looks
    near = {("a", f"x{i}"): f"near x{i}" for i in range(9)}
    assert first[1] == {k: near[k] for k in list(near)[:3]} | {
        ("b", "y"): "near y",
        ("a", "b"): "as b has it",
        ("a", "x3"): "near x3",
    }
    assert list(first[1])[:3] == [("a", "x0"), ("b", "y"), ("a", "x1")]
    assert again[1] == {("a", "b"): "as a has it"}
    # Those 108 and 120 behind are not looked at.
    assert list(then[1].items()) == [*list(near.items())[4:], (("b", "z"), "near z")]
    assert rest == [("look_closer_beside", sorted(closer, reverse=True)), ("hear", None)]
    assert closer == set(sorted([*first[1], *then[1]], reverse=True)[:6])
    assert not rough.spared


def test_a_closer_look_is_about_the_best_place_so_far_and_as_far_as_usual():
    looks = []
    rough = Standings({("a", "b"): 2.0, ("a", "c"): 1.0})
    rough.start = lambda *given, **more: looks.append((given, more))
    pairs.look_closer_beside(rough, [("a", "c")])
    assert looks == [(({("a", "c"): "where ('a', 'c') is"}, 6), {})]


@pytest.mark.parametrize(("pairs_placed", "looked_at"), [(18, 18), (19, 18), (40, 18)])
def test_no_more_are_looked_at_than_the_likeliest(monkeypatch, pairs_placed, looked_at):
    placed = {("a", f"x{i}"): Place("", -0.1 * i) for i in range(pairs_placed)}
    rough = Rough(monkeypatch, {("a",): placed})
    rough.look_beside_all()
    looks = [what for name, what in rough.looks if name == "look_beside"]
    assert [key for some in looks for key in some] == list(placed)[:looked_at]
    # As many as are ever looked at were.
    assert not rough.spared


@pytest.mark.parametrize(("apart", "closer"), [(50.0, 6), (5.1, 8), (4.9, 9), (2.0, 14), (0.0, 14)])
def test_all_that_do_about_as_well_are_looked_at_closer(monkeypatch, apart, closer):
    """Few runs rank them by chance."""
    rough = Rough(monkeypatch, {("a",): {("a", f"x{i}"): Place("", 0.0) for i in range(18)}})
    monkeypatch.setattr(Rough, "apart", apart)
    assert rough.look_beside_all() == set(sorted(rough.found, reverse=True)[:closer])


def test_who_leads_with_the_runs_of_one_of_its_causes_is_looked_at_closer_too(monkeypatch):
    """Three beside each at most, and who needs no lent runs to be looked at is not one more."""
    ten = [("a", f"x{i}") for i in range(10)]
    placed = {("a",): dict.fromkeys(ten, Place("", 0.0)), ("b",): {("b", "a"): Place("", 0.0)}}
    leads = {("a", "x9"): 80.0, ("a", "x1"): 30.0, ("a", "x2"): 20.0, ("a", "x0"): 9.0}
    lent = {(("a",), key): lead for key, lead in leads.items()} | {(("b",), ("b", "a")): 5.1}
    rough = Rough(monkeypatch, placed, lent=lent)
    closer = rough.look_beside_all()
    assert ("b", "a") in closer
    assert closer - {("b", "a")} == {*ten[5:], ("a", "x1"), ("a", "x2")}
    assert rough.looks[-2][1].count(("a", "x9")) == 1


def test_nobody_is_looked_at_closer_twice_for_both_of_its_causes(monkeypatch):
    placed = {("a",): {("a", "b"): Place("", 0.0)}, ("b",): {("a", "b"): Place("", 0.0)}}
    placed[("b",)] |= {("b", f"x{i}"): Place("", 0.0) for i in range(8)}
    lent = {(part, ("a", "b")): 40.0 for part in placed}
    rough = Rough(monkeypatch, placed, lent=lent)
    assert ("a", "b") in rough.look_beside_all()
    assert rough.looks[-2][1].count(("a", "b")) == 1


@pytest.mark.parametrize(("spent", "looked_at"), [(0.0, 13), (0.5, 12), (0.6, 6), (2.0, 6)])
def test_no_more_are_looked_at_once_most_of_the_purse_is_spent(monkeypatch, spent, looked_at):
    """Each look takes a fifth of it; the first is worth it whatever was spent."""
    effort = Effort()
    effort.add(spent * 1e6)
    placed = {("a", f"x{i}"): Place("", -1.0 * i) for i in range(13)}
    rough = Rough(
        monkeypatch, {("a",): placed}, Purse(effort, granted_s=1e6), lambda: effort.add(0.2e6)
    )
    closer = rough.look_beside_all()
    looks = [what for name, what in rough.looks if name == "look_beside"]
    assert [key for some in looks for key in some] == list(placed)[:looked_at]
    assert len(closer) == 6
    assert rough.spared == (looked_at < len(placed))


@pytest.mark.parametrize(
    ("hidden_at", "looks"), [(0.2, [0.3]), (0.46, [0.3, 0.42]), (0.9, [0.3, 0.42, 0.54])]
)
def test_who_agrees_best_at_the_end_of_its_ratios_is_followed_and_nobody_else(hidden_at, looks):
    """At most two steps; one whose ratio is known is left where it is."""
    moved, known = ("a", "moves"), ("a", "stays")
    ratios, looked = {moved: [], known: []}, []

    class Rough:
        found = {}

        def start(self, places, groups, reach):
            assert (groups, reach) == (4, (0.12, 0.03))
            looked.append({key: round(float(place[0]), 2) for key, place in places.items()})
            for key, place in places.items():
                ratios[key] += list(place[0] + np.linspace(-0.12, 0.12, 9))
                runs = np.column_stack([ratios[key], np.full(len(ratios[key]), 0.5)])
                best = runs[np.argmin(abs(runs[:, 0] - (hidden_at if key == moved else 0.3)))]
                self.found[key] = SimpleNamespace(
                    surface=SimpleNamespace(places=runs), best=SimpleNamespace(place=best)
                )

    pairs.look_beside(Rough(), {key: np.array([0.3, 0.5]) for key in (moved, known)})
    assert looked[0] == {moved: 0.3, known: 0.3}
    assert looked[1:] == [{moved: at} for at in looks[1:]]


@pytest.mark.parametrize(
    ("ratios", "best", "follow"),
    [((0.2, 0.4), 0.39, True), ((0.2, 0.4), 0.22, True), ((0.2, 0.4), 0.3, False),
     # There is nothing beyond all and nothing.
     ((0.8, 1.0), 0.99, False), ((0.0, 0.2), 0.01, False), ((0.0, 0.2), 0.19, True)],
)  # fmt: skip
def test_the_end_of_all_ratios_is_no_end_to_be_followed(ratios, best, follow):
    runs = np.column_stack([np.linspace(*ratios, 9), np.full(9, 0.5)])
    one = SimpleNamespace(
        surface=SimpleNamespace(places=runs), best=SimpleNamespace(place=np.array([best, 0.5]))
    )
    assert pairs._is_at_an_end(one) is follow


def test_pairs_that_add_up_exactly_are_looked_at_whatever_is_favoured(monkeypatch):
    felt, unlike = ("cable-stiffness", "load-inertia"), ("cable-stiffness", "load-viscous-damping")
    others = [("a", f"x{i:02}") for i in range(40)]
    places = {key: Place(None, -float(i)) for i, key in enumerate(others)}
    places |= {felt: Place("where it is felt alike", -1000.0), unlike: Place(None, -1081.0)}
    glanced, started, closer = [], [], []
    rough = SimpleNamespace(
        unit=None,
        observation=None,
        best_single=("a",),
        take_over=lambda candidates, groups: None,
        start=lambda starts, groups: started.append(starts),
        among=lambda keys: [felt, *others] if felt in keys else others,
        look_closer=lambda keys, groups: closer.append(keys),
    )
    monkeypatch.setattr(pairs, "add_causes", lambda *_: SimpleNamespace(felt=[felt, unlike]))
    monkeypatch.setattr(pairs, "screen_pairs", lambda *_: places)
    monkeypatch.setattr(pairs, "_glance", lambda _, places, most: glanced.extend(places))
    monkeypatch.setattr(pairs, "_hold_against_neighbours", lambda *_: None)
    pairs.search_pairs(rough, {}, RNG)
    assert not {felt, unlike} & set(glanced)
    assert set(others[:10]) <= set(glanced)
    assert started == [{felt: "where it is felt alike"}]
    assert closer[:2] == [[felt], [felt]]
    assert felt in closer[2]


def test_a_pair_is_glanced_at_at_both_of_its_ratios(monkeypatch):
    one, other = ("a", "b"), ("a", "c")
    places = {one: Place("low", 0.0, other="high"), other: Place("middle", 1.0)}
    started = []
    few = SimpleNamespace(
        start=lambda starts, groups: started.append((dict(starts), groups)),
        found={one: "found one", other: "found other"},
        leading=lambda most: [other, one][:most],
    )
    rough = SimpleNamespace(observation=None, thinned=lambda stride: few)
    monkeypatch.setattr(pairs, "coarse_stride", lambda *_: 2)
    assert pairs._glance(rough, places, 10) == ["found other", "found one"]
    assert started == [({one: "low", other: "middle"}, 4), ({one: "high"}, 4)]


def test_nothing_to_glance_at_is_no_trouble(runs):
    rough = synthetic_search.hunted([0.8], 1)
    rough.take_over(pairs._glance(rough, {}, 10), 3)
    assert rough.found == {}
