"""Presets of one's own: in files, in provenance, and in the reference that judges an estimate."""

import numpy as np
import pytest

import codriver as cd
from codriver.errors import UsageError
from codriver.observers import PRESETS, find_preset, preset_of, save_preset
from codriver.observers.preset_file import parse_preset
from conftest import motion_log

OWN = cd.Preset((0.013, 1 / 3, 1e-7, 2.5), (0.9, 1.1e-3), 1.7, "made up", "mine")
GOOD = 'name = "a"\nsource = "b"\nell = 2\nQ = [1, 1, 1, 1]\nR = [1, 1]\n'


def test_a_file_gives_the_preset_back(tmp_path):
    save_preset(OWN, tmp_path / "mine.toml")
    assert find_preset(tmp_path / "mine.toml") == OWN
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_papers_by_name(name):
    assert find_preset(name) is PRESETS[name]
    assert PRESETS[name].name == name


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("ell = 2", "el = 2"), "'el' is not known; 'ell' is missing"),
        (("Q = [1, 1, 1, 1]", "Q = [1, 1, 1]"), "'Q' must be a list of 4 numbers"),
        (("R = [1, 1]", "R = [1, -1]"), "'R' must be a list of 2 numbers above 0"),
        (("R = [1, 1]", "R = [1, nan]"), "'R' must be a list of 2 numbers above 0"),
        (("ell = 2", "ell = 1000"), "'ell' must be a number from"),
        (('"a"', '"bisoffi2017"'), "is a paper's"),
        (('"a"', "3"), "'name' must be a text"),
        (("ell", "[ell"), "is not TOML"),
    ],
)
def test_wrong_files(change, said):
    with pytest.raises(UsageError) as caught:
        parse_preset(GOOD.replace(*change), "file")
    assert said in str(caught.value)


def test_unknown_preset():
    with pytest.raises(UsageError, match=r"did you mean .bisoffi2017"):
        find_preset("bisofi2017")
    with pytest.raises(UsageError, match="cannot read"):
        find_preset("not_there.toml")


def test_provenance_makes_the_same_design(tmp_path):
    """From what an estimate says of itself, the same estimate again."""
    save_preset(OWN, tmp_path / "mine.toml")
    log, _ = motion_log(20)
    estimate = cd.estimate_log("kinematic", log, preset=tmp_path / "mine.toml")
    assert (estimate.provenance["preset"], estimate.provenance["ell"]) == ("mine", "1.7")
    again = cd.estimate_log("kinematic", log, preset=preset_of(estimate.provenance))
    np.testing.assert_array_equal(estimate.columns["longitudinal_jerk"], again.columns["longitudinal_jerk"])
    other = cd.estimate_log("kinematic", log)
    assert preset_of(other.provenance) == PRESETS["bisoffi2017"]
    assert np.abs(other.columns["longitudinal_jerk"] - again.columns["longitudinal_jerk"]).max() > 1e-3


def test_judging_an_estimate_with_an_own_preset(demo, car):
    """The delay-matched reference has the estimate's own noise: the error stays the paper preset's where Q, R are its own."""
    from codriver.simulate.judge import delay_matched, judge

    paper = PRESETS["bisoffi2017"]
    copy = cd.Preset(paper.Q, paper.R, paper.ell, "a copy", "copy")
    rows = [judge(cd.estimate_log("intent-pedals", demo.measured, car, preset=p), demo.truth) for p in (paper, copy)]
    assert rows[0] == rows[1]
    estimate = cd.estimate_log("intent-pedals", demo.measured, car, preset=OWN)
    own, valid = delay_matched(estimate, demo.truth, "intentional_acceleration"), estimate.valid
    error = estimate.columns["intentional_jerk"] - own.columns["intentional_jerk"]
    assert np.sqrt(np.mean(error[valid] ** 2)) < 0.3 * np.sqrt(np.mean(own.columns["intentional_jerk"][valid] ** 2))
