"""What a level shows, written as JSON and as text."""

import math

from analysis.resonance.records import Feature, LevelFeatures, summary, to_json


def test_json_of_missing_features_is_null():
    missing = LevelFeatures(1.0, None, None, None, None, ("arf: none", "rf: none"))
    (level,) = to_json([missing])["levels"]
    assert level["arf"] is None
    assert level["rf"] is None
    assert level["difference_hz"] is None
    assert level["damping_ratio"] == {"arf": None, "rf": None}
    assert level["flags"] == ["arf: none", "rf: none"]


def test_json_never_holds_not_a_number():
    odd = Feature(40.0, math.nan, -20.0, math.inf, None, None, "grid")
    (level,) = to_json([LevelFeatures(1.0, odd, None, math.nan, None, ())])["levels"]
    assert level["arf"]["std_hz"] is None
    assert level["arf"]["gain_std_db"] is None
    assert level["difference_hz"] is None


def test_summary_is_aligned_with_flags_below():
    arf = Feature(39.9662, 0.0071, -21.5, 0.05, 0.0301, 0.0003, "rational")
    rf = Feature(130.6, 2.34, -3.21, 0.4, None, None, "grid")
    lines = summary(
        [
            LevelFeatures(2.5, arf, rf, 90.63, 2.34, ("rf: nonlinear peak",)),
            LevelFeatures(4.0, None, None, None, None, ("arf: none", "rf: none")),
        ]
    )
    assert lines == [
        "V pk                     Hz               dB            damping  RF - ARF, Hz",
        " 2.5  ARF  39.9662 ± 0.0071  -21.500 ± 0.050  0.03010 ± 0.00030",
        "       RF       130.6 ± 2.3     -3.21 ± 0.40                  -    90.6 ± 2.3",
        "   4  ARF                 -                -                  -",
        "       RF                 -                -                  -             -",
        "2.5 V  rf: nonlinear peak",
        "4 V  arf: none",
        "4 V  rf: none",
    ]
    assert max(map(len, lines)) <= 80
