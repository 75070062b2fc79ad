"""What is said of a verdict follows its probability and what the model leaves."""

import pytest

from analysis.selection.wording import likelihood_words, verdict_words


def document(verdict="consistent", nothing=0.97, rivals=(), residual=(), causes=()):
    return {
        "verdict": verdict,
        "causes": [{"effect": name} for name in causes],
        "rivals": [{"causes": [], "probability": nothing, "remark": ""}, *rivals],
        "residual": [{"sigma": sigma} for sigma in residual],
    }


def other(name, probability, remark=""):
    return {"causes": [name], "probability": probability, "remark": remark}


@pytest.mark.parametrize(
    ("probability", "words"),
    [
        (1.0, "virtually certain"), (0.97, "extremely likely"), (0.92, "very likely"),
        (0.75, "likely"), (0.62, "more likely than not"), (0.4, "about as likely as not"),
        (0.2, "unlikely"), (0.0, "very unlikely"),
    ],
)  # fmt: skip
def test_a_probability_has_one_word(probability, words):
    assert likelihood_words(probability) == words


@pytest.mark.parametrize("verdict", ["consistent", "explained", "ambiguous", "unexplained"])
def test_probability_of_nothing_hidden_has_its_number(verdict):
    said = " ".join(verdict_words(document(verdict, 0.62, causes=["load-inertia"])))
    assert "that nothing is hidden has probability 0.62: more likely than not" in said


def test_consistent_verdict_states_what_remains_open():
    """The report that told of nothing else to look for: 0.62, and 6.9 standard deviations."""
    rivals = [other("load-inertia", 0.3), other("shaft-damping", 0.06), other("x", 0.02)]
    said = " ".join(verdict_words(document(nothing=0.62, rivals=rivals, residual=[6.9, -3.2, 2.0])))
    assert (
        "load-inertia (probability 0.30) or shaft-damping (probability 0.06) is not ruled out"
        in said
    )
    assert "2 bands depart from the plain model, by up to 6.9 sigma" in said
    assert "nothing else" not in said


def test_rejected_set_is_not_stated_open():
    rivals = [other("load-inertia", 0.3, "fits worse than replicates of this model")]
    assert "Still open" not in " ".join(verdict_words(document(nothing=0.7, rivals=rivals)))


def test_certain_answer_leaves_nothing_open():
    assert verdict_words(document(nothing=0.97)) == [
        "Nothing beyond tolerance is needed to explain this response.",
        "Among the sets judged, that nothing is hidden has probability 0.97: extremely likely.",
    ]
