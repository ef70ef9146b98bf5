"""Shared fixtures. Recordings are not part of the project: tests that use them skip where the folder is missing."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import codriver as cd

ROOT = Path(__file__).parent.parent
# Files that take longest, longest first. A worker takes a file at a time: a long one begun last would leave the others idle.
LONG = (
    "test_papers", "test_paper_steering2019", "test_steering_identification", "test_driver_identification",
    "test_paper_drivers2019", "test_drivers_errata", "test_style", "test_identify", "test_tune", "test_paper_motorcycle2018",
    "test_style_of_driving", "test_motorcycle_trust", "test_export", "test_elementary", "test_learned_models", "test_mixtures",
)  # fmt: skip


def pytest_configure(config: pytest.Config) -> None:
    """One thread a worker: threads of linear algebra in each of them would spin while they wait for a core."""
    if getattr(config.option, "numprocesses", None):
        os.environ.setdefault("OMP_NUM_THREADS", "1")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long files first, where tests are handed out to several workers."""
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: LONG.index(item.path.stem) if item.path.stem in LONG else len(LONG))


def recording(folder: str) -> Path:
    """A folder of recorded data beside the project, or a skip that says what is missing."""
    path = ROOT.parent / "shared" / "data" / folder
    if not path.exists():
        pytest.skip(f"recordings not there: ../shared/data/{folder}")
    return path


def constant(name: str, value: float, time: np.ndarray) -> cd.Signal:
    return cd.Signal(name, time, np.full(time.size, float(value)), "")


def motion_log(
    seconds: float = 60.0, dt: float = 0.01, noise: float = 0.05, speed_noise: float = 0.02, seed: int = 0
) -> tuple[cd.Log, np.ndarray]:
    """A drive with sinusoidal jerk of 0.5 m/s^3 at 0.1 Hz, offset 0.3 m/s^2; and its true jerk."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / dt)) * dt
    w = 2 * np.pi * 0.1
    jerk = 0.5 * np.cos(w * t)
    a = 0.5 * np.sin(w * t) / w
    v = 20 + 0.5 * (1 - np.cos(w * t)) / w**2
    signals = [
        cd.Signal("longitudinal_acceleration", t, a + 0.3 + noise * rng.standard_normal(t.size), "m/s^2"),
        cd.Signal("longitudinal_speed", t, v + speed_noise * rng.standard_normal(t.size), "m/s"),
    ]
    return cd.Log.of(signals), jerk


@pytest.fixture(scope="session")
def car() -> cd.Vehicle:
    return cd.load_vehicle("bisoffi2017")


@pytest.fixture(scope="session")
def demo():
    from codriver.simulate import demo_drive

    return demo_drive(1)


@pytest.fixture(scope="session")
def demo_files(tmp_path_factory):
    from codriver.simulate import write_demo

    return write_demo(tmp_path_factory.mktemp("demo"), 1)
