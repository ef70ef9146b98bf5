"""Vehicle files, names files and units: what is right is converted, what is wrong is told all at once."""

import math

import pytest

import codriver as cd
from codriver.errors import NamesError, UnitError, VehicleError
from codriver.logs.names_file import load_names, parse_names
from codriver.names import VOCABULARY
from codriver.units import _FAST, to_si
from codriver.vehicles import Parameter, Vehicle, built_in_vehicles, save_vehicle
from codriver.vehicles.load import parse_vehicle

HEAD = 'name = "x"\ntitle = "X"\nsource = "test"\n'


def test_papers_cars():
    """2017 section IV and 2015 section V."""
    car = cd.load_vehicle("bisoffi2017")
    assert car.number("mass") == 1550
    assert car.numbers("transmission") == (41, 22, 14, 10, 8)
    assert car.number("brake_coefficient") == pytest.approx(189e-5)  # N/bar -> N/Pa
    assert car.number("pedal_coefficient") == pytest.approx(325)  # N m per percent -> N m
    old = cd.load_vehicle("bisoffi2015")
    assert (old.number("mass"), old.numbers("transmission")) == (1500, (13, 6.9, 4.3, 3.1, 2.5))


@pytest.mark.parametrize("name", built_in_vehicles())
def test_every_value_has_a_source(name):
    car = cd.load_vehicle(name)
    assert car.source
    assert all(p.source and p.unit for p in car.parameters.values())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[mas]\nvalue=1\nunit='kg'\nsource='s'", "did you mean 'mass'"),
        ("[mass]\nvalue=1550\nsource='s'", "lacks 'unit'"),
        ("[mass]\nvalue=1550\nunit='m'\nsource='s'", "same kind"),
        ("[mass]\nvalue=1550\nunit='furlongkg'\nsource='s'", "not known"),
        ("[mass]\nvalue=1.55\nunit='kg'\nsource='s'", "outside"),
        ("[mass]\nvalue=[1,2]\nunit='kg'\nsource='s'", "one number"),
        ("[mass]\nvalue=nan\nunit='kg'\nsource='s'", "one number"),
        ("[mass]\nvalue=true\nunit='kg'\nsource='s'", "one number"),
        ("[mass]\nvalue=1550\nunit='kg'\nsd=-1\nsource='s'", "sd must be"),
        ("[mass]\nvalue=1550\nunit='kg'\nsd=[1,2]\nsource='s'", "has 1 value and 2 sds"),
        ("[transmission]\nvalue=[41,22,14]\nunit='1/m'\nsd=[1,2]\nsource='s'", "has 3 values and 2 sds"),
        ("[mass]\nvalue=1550\nunit='kg'\nsource='s'\ncolour='red'", "unknown key 'colour'"),
        ("mass = 3", "not a parameter"),
        ("[transmission]\nvalue=[41, 'x']\nunit='1/m'\nsource='s'", "one number per gear"),
        ("not toml at all", "not TOML"),
    ],
)
def test_wrong_vehicle_files(text, said):
    with pytest.raises(VehicleError, match=said.replace("(", r"\(")):
        parse_vehicle(HEAD + text, "file.toml")


def test_all_faults_at_once():
    with pytest.raises(VehicleError) as raised:
        parse_vehicle("[mass]\nvalue=1\n[drag]\nvalue=1\nunit='s'\nsource='x'", "f")
    assert all(word in str(raised.value) for word in ("'name' is missing", "[mass] lacks", "[drag]"))


def test_unknown_vehicle():
    with pytest.raises(VehicleError, match="did you mean 'bisoffi2017'"):
        cd.load_vehicle("bisofi2017")


class TestWithParameter:
    def test_adds_one(self):
        zoe = cd.load_vehicle("renault-zoe")
        braked = zoe.with_parameter("brake_coefficient", 0.002, sd=0.0001, source="fitted")
        assert braked.parameters["brake_coefficient"] == Parameter("brake_coefficient", 0.002, "N/Pa", 0.0001, "fitted")
        assert "brake_coefficient" not in zoe

    def test_the_old_sd_does_not_belong_to_the_new_value(self):
        zoe = cd.load_vehicle("renault-zoe")
        assert zoe.parameters["mass"].sd == 80
        assert zoe.with_parameter("mass", 1600).parameters["mass"].sd is None

    def test_one_per_gear(self):
        car = cd.load_vehicle("bisoffi2017").with_parameter("transmission", [40, 20], sd=[2, 1])
        assert car.numbers("transmission") == (40, 20)
        assert car.parameters["transmission"].sd == (2, 1)

    def test_unknown_name(self):
        with pytest.raises(VehicleError, match="did you mean 'mass'"):
            cd.load_vehicle("renault-zoe").with_parameter("mas", 1500)


class TestSave:
    @pytest.mark.parametrize("name", built_in_vehicles())
    def test_round_trip(self, name, tmp_path):
        car = cd.load_vehicle(name)
        assert cd.load_vehicle(save_vehicle(car, tmp_path / "car.toml")) == car

    def test_every_digit_and_letter(self, tmp_path):
        odd = Vehicle('a "b"', "back\\slash \n\x7f", "é ☃ '", {}).with_parameter("drag", 1 / 3, 1e-5, "tab\t# text")
        odd = odd.with_parameter("transmission", (0.1 + 0.2, 41), (1 / 7, 0), "[mass]")
        assert cd.load_vehicle(save_vehicle(odd, tmp_path / "odd.toml")) == odd

    def test_nothing_is_replaced_unasked(self, tmp_path):
        car, path = cd.load_vehicle("renault-zoe"), tmp_path / "car.toml"
        save_vehicle(car, path)
        lighter = car.with_parameter("mass", 1400)
        with pytest.raises(VehicleError, match="there already"):
            save_vehicle(lighter, path)
        assert cd.load_vehicle(path) == car
        save_vehicle(lighter, path, overwrite=True)
        assert cd.load_vehicle(path) == lighter

    @pytest.mark.parametrize(
        ("file", "change", "said"),
        [
            ("car.toml", ("mass", 1.0), "outside 50 to 60000"),
            ("car.toml", ("mass", float("nan")), "value must be one number"),
            ("car.toml", ("transmission", (41, 22, 14), (1, 2)), "has 3 values and 2 sds"),
            ("car.yaml", ("mass", 1500), "ending in .toml"),
            ("no/car.toml", ("mass", 1500), "cannot write"),
        ],
    )
    def test_what_could_not_be_loaded_is_not_written(self, tmp_path, file, change, said):
        with pytest.raises(VehicleError, match=said):
            save_vehicle(cd.load_vehicle("renault-zoe").with_parameter(*change), tmp_path / file)
        assert not list(tmp_path.rglob("*"))

    def test_foreign_units_are_not_written(self, tmp_path):
        tonnes = Vehicle("x", "X", "test", {"mass": Parameter("mass", 1.5, "t", None, "scales")})
        with pytest.raises(VehicleError, match="another vehicle"):
            save_vehicle(tonnes, tmp_path / "car.toml")


@pytest.mark.parametrize(
    ("unit", "target", "x", "wanted"),
    [
        ("km/h", "m/s", 36, 10), ("mph", "m/s", 1, 0.44704), ("%", "1", 50, 0.5), ("percent", "1", 50, 0.5),
        ("bar", "Pa", 2, 2e5), ("g", "m/s^2", 1, 9.80665), ("deg", "rad", 180, math.pi), ("rpm", "rad/s", 60, 2 * math.pi),
        ("Nm", "N*m", 3, 3), ("m/s2", "m/s^2", 3, 3), ("N/bar", "N/Pa", 189, 189e-5), ("degC", "K", 0, 273.15), ("", "1", 1, 1),
        ("psi", "Pa", 1, 6894.757293168), ("°/s", "rad/s", 180, math.pi),
    ],
)  # fmt: skip
def test_units(unit, target, x, wanted):
    factor, offset = to_si(unit, target)
    assert factor * x + offset == pytest.approx(wanted)


def test_quick_table_is_pints():
    """The table that spares pint's start says what pint says."""
    import pint

    registry = pint.UnitRegistry()
    spell = {"%": "percent", "1": "dimensionless", "g": "standard_gravity", "rpm": "rpm", "kph": "km/h", "1/min": "rpm"}
    for (unit, target), factor in _FAST.items():
        if (unit, target) == ("rad", "%"):
            continue  # a slope in percent: small angles only, pint has no such unit
        quantity = registry.Quantity(1.0, spell.get(unit, unit)).to(spell.get(target, target))
        assert quantity.magnitude == pytest.approx(factor, rel=1e-12), (unit, target)


def test_wrong_units():
    with pytest.raises(UnitError, match="same kind"):
        to_si("kg", "m/s")
    with pytest.raises(UnitError, match="not known"):
        to_si("blargh", "m/s")


@pytest.mark.parametrize("entry", VOCABULARY.values(), ids=list(VOCABULARY))
def test_vocabulary_units(entry):
    """Every unit is known, and the one shown is of the same kind."""
    if (entry.unit, entry.display) != ("rad", "%"):
        to_si(entry.display, entry.unit)
    assert entry.low < entry.high


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[speed]\nsource='a'", "not a standard signal name"),
        ("[longitudinal_sped]\nsource='a'", "did you mean 'longitudinal_speed'"),
        ("[gear]\nunit='1'", "source must be"),
        ("[gear]\nsource=3", "source must be"),
        ("[gear]\nsource='a'\nscale='big'", "scale must be a number"),
        ("[gear]\nsource='a'\nscale=0", "scale must not be 0"),
        ("[gear]\nsource='a'\nsign=2", "sign must be 1 or -1"),
        ("[longitudinal_speed]\nsource='a'\nunit='kg'", "same kind"),
        ("[gear]\nsource='a'\nfactor=2", "unknown key 'factor'"),
        ("", "no signal is mapped"),
        ("[[[", "not TOML"),
    ],
)
def test_wrong_names_files(text, said):
    with pytest.raises(NamesError, match=said):
        parse_names(text, "names.toml")


@pytest.mark.parametrize(
    ("load", "kind", "what"), [(cd.load_vehicle, VehicleError, "vehicle file"), (load_names, NamesError, "names file")]
)
def test_files_that_cannot_be_read(load, kind, what, tmp_path):
    with pytest.raises(kind, match="cannot read"):
        load(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(kind, match=f"(?s)is no text.*check that it is the {what}"):
        load(tmp_path / "bytes.toml")
