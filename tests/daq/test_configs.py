"""Files that come with lashbench are found by name, others by path."""

import pytest

from daq.configs import config_names, config_path, sample_names, sample_path
from daq.errors import ConfigurationError
from daq.formats import read_response


def test_shipped_file_is_found_in_any_case():
    assert {"adss", "edss"} < set(config_names("units"))
    assert config_path("units", "ADSS") == config_path("units", "adss")
    assert config_path("units", "adss").read_text().startswith("# ADSS")


def test_path_finds_own_file(tmp_path):
    own = tmp_path / "mine.toml"
    own.write_text("")
    assert config_path("units", str(own)) == own


@pytest.mark.parametrize("name", ["nosuch", "", "..", "/", "\x00", "x" * 5000, "../units/adss"])
def test_unknown_name_is_refused_with_known_ones(name):
    with pytest.raises(ConfigurationError, match="adss, edss"):
        config_path("units", name)


def test_the_samples_can_be_read():
    assert sample_names()
    for name in sample_names():
        assert read_response(sample_path(name)).unit in ("ADSS", "EDSS")
    with pytest.raises(ConfigurationError, match="adss-sweep"):
        sample_path("../units/adss")
