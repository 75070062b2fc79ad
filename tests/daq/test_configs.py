"""Files that come with lashbench are found by name, others by path."""

import pytest

from daq.configs import config_names, config_path, sample_names, sample_path
from daq.errors import ConfigurationError
from daq.formats import read_response


def test_a_name_finds_the_file_that_comes_with_it_in_any_case():
    assert {"adss", "edss"} < set(config_names("units"))
    assert config_path("units", "ADSS") == config_path("units", "adss")
    assert config_path("units", "adss").read_text().startswith("# ADSS")


def test_a_path_finds_a_file_of_ones_own(tmp_path):
    own = tmp_path / "mine.toml"
    own.write_text("")
    assert config_path("units", str(own)) == own


@pytest.mark.parametrize("name", ["nosuch", "", "..", "/", "\x00", "x" * 5000, "../units/adss"])
def test_anything_else_is_refused_and_the_names_are_listed(name):
    with pytest.raises(ConfigurationError, match="adss, edss"):
        config_path("units", name)


def test_the_samples_can_be_read():
    assert sample_names()
    for name in sample_names():
        assert read_response(sample_path(name)).unit in ("ADSS", "EDSS")
    with pytest.raises(ConfigurationError, match="adss-sweep"):
        sample_path("../units/adss")
