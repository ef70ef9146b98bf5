"""Modes against speed: Meijaard's critical speeds, Sharp's roots by name, the page and the command."""

from __future__ import annotations

import json

import numpy as np
import pytest

import codriver as cd
from codriver.cli.app import app
from codriver.models import (
    LPV,
    BicycleParameters,
    MotorcycleParameters,
    bicycle_lpv,
    bicycle_matrices,
    motorcycle_model,
)
from codriver.models.modes import follow_modes
from codriver.report.document import write_document
from codriver.report.modes import mode_sentences, modes_document
from test_bicycle import BENCHMARK
from test_motorcycle import FOOT, PRINTED


@pytest.fixture(scope="module")
def bicycle():
    return follow_modes(bicycle_lpv(bicycle_matrices(BENCHMARK).to_iso()), 0.0, 10.0)


@pytest.fixture(scope="module")
def sharp():
    return follow_modes(motorcycle_model(MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971"))), 0.5, 60.0)


class TestBicycle:
    def test_critical_speeds(self, bicycle):
        """Weave and capsize speed as Meijaard et al. print them, section 6: 4.29238253634111 and 6.02426201538837 m/s."""
        ((low, high),) = bicycle.stable_ranges()
        assert low == pytest.approx(4.29238253634111, abs=1e-11)
        assert high == pytest.approx(6.02426201538837, abs=1e-10)
        ((weave, _),) = bicycle.stable_ranges("weave")
        ((first, capsize),) = bicycle.stable_ranges("capsize")
        assert weave == pytest.approx(4.29238253634111, abs=1e-9)
        assert capsize == pytest.approx(6.02426201538837, abs=1e-9)
        assert first == 0
        assert bicycle.stable_ranges("caster") == ((0.0, 10.0),)

    def test_names(self, bicycle):
        assert sorted(bicycle.names) == ["capsize", "caster", "weave", "weave"]
        assert bicycle.modes == ("weave", "capsize", "caster")
        # table 2 at 5 m/s, and the four single roots at a standstill, of which the positive ones become the weave
        k = int(np.argmin(np.abs(bicycle.speeds - 5)))
        assert bicycle.speeds[k] == pytest.approx(5)
        assert bicycle.of("caster")[k, 0].real == pytest.approx(-14.0783896927982, abs=1e-8)
        assert bicycle.of("capsize")[k, 0].real == pytest.approx(-0.32286642900409, abs=1e-8)
        assert np.sort(bicycle.of("weave")[0].real) == pytest.approx([3.13164324790656, 5.53094371765393])

    def test_the_package_bicycleparameters(self):
        """Eigenvalues of its own benchmark file by its own code."""
        from bicycleparameters.models import Meijaard2007Model
        from bicycleparameters.parameter_sets import Meijaard2007ParameterSet

        letters = {"IBzz": 2.8, "IHzz": 0.00708, "IByy": 11.0, "IHyy": 0.06}
        own = {k: float(v) for k, v in vars(BENCHMARK).items()} | letters
        theirs = Meijaard2007Model(Meijaard2007ParameterSet({**own, "v": 1.0}, True))
        ours = bicycle_lpv(bicycle_matrices(BicycleParameters.from_vehicle(cd.load_vehicle("meijaard2007"))))
        for v in (0.5, 3.0, 7.0):
            values, _ = theirs.calc_eigen(v=v)
            assert np.allclose(
                np.sort_complex(np.ravel(values)), np.sort_complex(np.linalg.eigvals(ours.A(v))), atol=1e-9
            )


class TestMotorcycle:
    def test_names(self, sharp):
        assert sharp.modes == ("weave", "capsize", "wobble", "caster", "rear wobble")
        assert [sharp.names.count(mode) for mode in sharp.modes] == [2, 1, 2, 1, 2]

    @pytest.mark.parametrize("feet", PRINTED)
    def test_printed_roots_by_name(self, sharp, feet):
        """A root printed as weave is called weave here, at all eight speeds, and so are the others."""
        capsize, weave, weave_im, wobble, wobble_im = PRINTED[feet]
        for name, re_, im in (("capsize", capsize, 0.0), ("weave", weave, weave_im), ("wobble", wobble, wobble_im)):
            columns = sharp.of(name)
            root = [np.interp(feet * FOOT, sharp.speeds, f(columns[:, 0])) for f in (np.real, lambda x: np.abs(x.imag))]
            assert root[0] == pytest.approx(re_, abs=0.03), name
            assert root[1] == pytest.approx(im, abs=0.06), name

    def test_ranges(self, sharp):
        ((low, high),) = sharp.stable_ranges()
        assert 19 * FOOT < low < 20 * FOOT  # printed: -0.18 at 20 ft/s, weave just stable
        assert 30 * FOOT < high < 40 * FOOT  # capsize diverges above about 35 ft/s
        assert (
            np.linalg.eigvals(sharp.model.A(low - 1e-6)).real.max()
            > 0
            > np.linalg.eigvals(sharp.model.A(low + 1e-6)).real.max()
        )
        ((first, wobble),) = sharp.stable_ranges("wobble")
        assert first == 0.5
        assert 160 * FOOT < wobble < 60

    def test_columns_are_smooth(self, sharp):
        """A root moves with the speed; none jumps to another's place."""
        steps = np.abs(np.diff(sharp.roots, axis=0))
        assert steps.max() < 0.06 * np.abs(sharp.roots).max()


def two_that_meet():
    """Roots -2 +- sqrt(1.2 - v) and -5 +- sqrt(v - 1), by hand."""
    base = np.array([[-2, 1, 0, 0], [1.2, -2, 0, 0], [0, 0, -5, 1], [0, 0, -1, -5]], float)
    slope = np.zeros((4, 4))
    slope[1, 0], slope[3, 2] = -1, 1
    names = ("roll_angle", "roll_rate", "steer_angle", "steer_rate")
    return follow_modes(LPV({0: base, 1: slope}, np.zeros((4, 0)), np.zeros((0, 4)), names, (), ()), 0.0, 2.0)


class TestFollowing:
    def test_two_modes_that_meet(self):
        """The first two of `two_that_meet` become a pair of two modes."""
        found = two_that_meet()
        assert sorted(found.names) == ["capsize", "caster", "weave", "weave"]
        assert found.shared(0) == {}
        pair = found.shared(int(np.argmin(np.abs(found.speeds - 1.5))))
        assert {found.names[i]: other for i, other in pair.items()} == {"capsize": "caster", "caster": "capsize"}

    def test_refusals(self, sharp):
        with pytest.raises(ValueError, match="upwards"):
            follow_modes(sharp.model, 5.0, 5.0)
        other = LPV({0: np.eye(1)}, np.zeros((1, 0)), np.zeros((0, 1)), ("yaw_rate",), (), ())
        with pytest.raises(ValueError, match="roll_angle"):
            follow_modes(other, 0.0, 5.0)


class TestPage:
    def test_words(self, bicycle, sharp):
        told = [text for _, text in mode_sentences(bicycle)]
        assert told[0] == "Stable without the rider's control from 4.29 to 6.02 m/s (15.5 to 21.7 km/h)."
        assert any(text.startswith("Caster") and "at all speeds" in text for text in told)
        fast = follow_modes(sharp.model, 20.0, 30.0)
        severity, text = mode_sentences(fast)[0]
        assert severity == "warn"
        assert text == "Stable without the rider's control at no speed from 20.00 to 30.00 m/s (72.0 to 108.0 km/h)."

    def test_pair_of_two_modes_is_told(self):
        told = [text for _, text in mode_sentences(two_that_meet())]
        assert told[-1].startswith("capsize and caster are one pair between 1.2")

    def test_document(self, sharp, tmp_path):
        machine = cd.load_vehicle("sharp1971")
        write_document(modes_document(sharp, machine, "tested"), tmp_path / "modes.html")
        text = (tmp_path / "modes.html").read_text(encoding="utf-8")
        assert all(word in text for word in ("wobble", "capsize", "appendix 3, M_f", "Root locus"))

    @pytest.mark.parametrize("name", ["sharp1971", "meijaard2007", "pasma2024"])
    def test_command(self, capsys, tmp_path, name):
        out = tmp_path / "modes.html"
        said = command(capsys, "plot", "modes", name, "-o", str(out), "--speeds", "1:9", "--json")
        told = json.loads(said)
        assert told["speeds"] == [1.0, 9.0]
        assert "weave" in told["modes"]
        assert out.exists()
        assert name in command(capsys, "plot", "modes", name)

    @pytest.mark.parametrize(
        ("arguments", "text"),
        [(("bisoffi2017",), "is no two-wheeler"), (("sharp1971", "--speeds", "9:1"), "FROM:TO in m/s"),
         (("sharp1971", "--speeds", "x"), "FROM:TO in m/s")],
    )  # fmt: skip
    def test_refusals(self, capsys, arguments, text):
        with pytest.raises(cd.errors.CodriverError, match=text):
            command(capsys, "plot", "modes", *arguments)


def command(capsys, *arguments: str) -> str:
    """What a command prints."""
    app(arguments, standalone_mode=False)
    return capsys.readouterr().out
