"""A program of fewer outputs: the same bits, and no work for what was not asked for."""

import numpy as np
import pytest

import codriver as cd
from codriver.signals import Grid


def random_grid(observer, n=400):
    rng = np.random.default_rng(2)
    columns = {name: rng.standard_normal(n) + (10 if name == "longitudinal_speed" else 0) for name in observer.channels}
    flags = {name: rng.random(n) < 0.7 for name in observer.channels}
    return Grid(np.arange(n) * observer.dt, observer.dt, columns, flags, flags)


@pytest.mark.parametrize("form", ["kalman", "constant"])
@pytest.mark.parametrize("name", ["intent-pedals", "intent-torque", "kinematic"])
def test_each_alone_has_the_bits_of_all(name, form, car):
    observer = cd.build(name, car, form=form)
    grid = random_grid(observer)
    everything = cd.compile(observer).run_grid(grid)
    for output in observer.outputs:
        alone = cd.compile(observer, [output.name]).run_grid(grid)
        assert list(alone) == [output.name]
        assert alone[output.name].tobytes() == everything[output.name].tobytes(), output.name


def test_noise_scale_is_not_learnt_for_estimates_alone():
    observer = cd.build("kinematic")
    estimates = [o.name for o in observer.outputs if o.role == "estimate"]
    program, everything = cd.compile(observer, estimates), cd.compile(observer)
    assert not any(name.startswith("scale") for name in program.recorded.carry)
    assert any(name.startswith("scale") for name in everything.recorded.carry)
    assert program.recorded.operations() < 0.8 * everything.recorded.operations()


def test_saved_state_is_that_of_the_outputs():
    observer = cd.build("kinematic")
    few, everything = cd.compile(observer, ["longitudinal_jerk"]).live(), cd.compile(observer).live()
    few.restore(few.save())
    with pytest.raises(cd.CodriverError, match="outputs"):
        everything.restore(few.save())


def test_two_divisions_update_the_covariance():
    """Counted, not timed: one division a row, whatever the recorder makes of the algebra."""
    observer = cd.build("kinematic")
    estimates = [o.name for o in observer.outputs if o.role == "estimate"]
    kinds = [i.kind for i in cd.compile(observer, estimates).recorded.instructions]
    assert sum(kind in ("div", "inverse") for kind in kinds) == 2
