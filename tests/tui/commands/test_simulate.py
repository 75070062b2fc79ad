"""``lashbench simulate``: every option reaches the sweep, and nothing is written on failure."""

import numpy as np
import pytest

from daq.formats import read_response
from tui.cli import main

SWEEP = (
    "simulate --unit adss --ratio 0.5 --start 200 --stop 220 --points 3"
    " --settle-cycles 2 --integrate-cycles 3"
)


def sweep_with(extra):
    """The words of the sweep, with `extra` in place of the options that it names too."""
    words, plain = extra.split(), SWEEP.split()
    pairs = zip(plain[1::2], plain[2::2], strict=True)
    return ["simulate", *(word for pair in pairs if pair[0] not in words for word in pair), *words]


def simulated(path, extra="--level 2.5"):
    assert main([*sweep_with(extra), "--out", str(path)]) == 0
    return read_response(path)


def test_file_holds_the_requested_sweep(tmp_path, capsys):
    response = simulated(
        tmp_path / "r.csv", "--level 2.5 --level 1.5 --direction down --spacing log --from-rest"
    )
    assert capsys.readouterr().out == ""
    assert response.unit == "ADSS"
    assert response.levels_vpk.tolist() == [1.5, 2.5]
    for level in (1.5, 2.5):
        grid = response.at_level(level).frequency_hz
        np.testing.assert_allclose(grid, [200, np.sqrt(200 * 220), 220], rtol=1e-12)
    assert response.direction == "down"
    assert (response.settle_cycles, response.integrate_cycles, response.from_rest) == (2, 3, True)
    assert response.provenance["kind"] == "simulated"
    assert response.phase_known.all()
    assert np.isfinite(response.gain_std_db).all()


def test_the_same_words_give_the_same_file(tmp_path):
    simulated(tmp_path / "a.csv")
    simulated(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


@pytest.mark.parametrize(
    "extra",
    [
        "--level 2.5 --seed 1",
        "--level 2.5 --set k_ts=0.08",
        "--level 2.5 --effect tachometer-gain:k_ts=0.08",
        "--level 2.5 --effect payload-flexibility:J_p=0.001,f_p=75,zeta_p=0.03",
        "--level 2.5 --from-rest",
        "--level 2.5 --direction down",
    ],
)
def test_each_option_changes_the_response(tmp_path, extra):
    plain = simulated(tmp_path / "plain.csv")
    other = simulated(tmp_path / "other.csv", extra)
    assert np.abs(other.gain - plain.gain).max() > 1e-6


def test_parameter_and_its_effect_are_equivalent(tmp_path):
    by_set = simulated(tmp_path / "set.csv", "--level 2.5 --set k_ts=0.08")
    by_effect = simulated(tmp_path / "effect.csv", "--level 2.5 --effect tachometer-gain:k_ts=0.08")
    np.testing.assert_allclose(by_set.gain, by_effect.gain, rtol=1e-9)


def test_own_unit_is_read_by_path(tmp_path):
    from daq.configs import config_path

    own = tmp_path / "own.toml"
    own.write_text(config_path("units", "adss").read_text().replace('"ADSS"', '"My servo"'))
    response = simulated(tmp_path / "own.csv", f"--level 2.5 --unit {own}")
    assert response.unit == "My servo"


BAD = [
    "--level 0",
    "--level -1",
    "--level nan",
    "--level 1 --level 1",
    "--level 1,5",
    "--level 1 --ratio 1.5",
    "--level 1 --ratio -0.1",
    "--level 1 --start 0",
    "--level 1 --start 300",
    "--level 1 --start 1e-9",
    "--level 1 --points 1",
    "--level 1 --points 2.5",
    "--level 1 --points 1000000000",
    "--level 1 --settle-cycles -1",
    "--level 1 --integrate-cycles 0",
    "--level 1 --settle-cycles 1000000000000",
    "--level 1 --seed -1",
    "--level 1 --spacing cubic",
    "--level 1 --direction sideways",
    "--level 1 --unit gone",
    "--level 1 --set J_L",
    "--level 1 --set J_L=-1",
    "--level 1 --set J_L=nan",
    "--level 1 --set J_L=1 --set J_L=2",
    "--level 1 --set nosuch=1",
    "--level 1 --effect nosuch:x=1",
    "--level 1 --effect load-inertia",
    "--level 1 --effect load-inertia:J_L=heavy",
    "--level 1 --effect load-inertia:J_L=-1",
    "--level 1 --effect load-inertia:J_L=0.003,B_L=1",
    "--level 1 --effect load-inertia:J_L=0.003 --effect load-inertia:J_L=0.004",
]


@pytest.mark.parametrize("extra", BAD)
def test_bad_value_is_refused_and_nothing_written(tmp_path, capsys, extra):
    assert main([*sweep_with(extra), "--out", str(tmp_path / "r.csv")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[-1].startswith("error: ")
    assert "internal" not in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["", "r.txt", "folder.csv", "gone/r.csv"])
def test_unwritable_place_is_refused_before_simulation(tmp_path, capsys, name):
    (tmp_path / "folder.csv").mkdir()
    assert main([*SWEEP.split(), "--level", "1", "--out", f"{tmp_path}/{name}"]) == 2
    assert "simulating" not in capsys.readouterr().err


def test_dc_offset_acts_and_is_recorded(tmp_path):
    plain = simulated(tmp_path / "plain.csv")
    leaning = simulated(tmp_path / "leaning.csv", "--level 2.5 --offset 1.5")
    assert (plain.dc_offset_v, leaning.dc_offset_v) == (0.0, 1.5)
    # The mean of the output follows the motor's, which turns one way now.
    assert np.max(np.abs(leaning.gain - plain.gain)) > 0.01 * np.max(np.abs(plain.gain))


def test_ratio_is_needed_of_two_stages(tmp_path, capsys):
    """With one stage it can only be 1: the response is the same to the last bit."""
    words = [*SWEEP.replace("--ratio 0.5 ", "").split(), "--level", "2"]
    assert main([*words, "--out", str(tmp_path / "two.csv")]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "--ratio" in line
    assert "two stages" in line
    assert not (tmp_path / "two.csv").exists()
    words[words.index("adss")] = "r3-1"
    gains = []
    for name, ratio in (("a.csv", []), ("b.csv", ["--ratio", "1"])):
        assert main([*words, *ratio, "--out", str(tmp_path / name)]) == 0
        gains.append(read_response(tmp_path / name).gain)
    np.testing.assert_array_equal(*gains)
