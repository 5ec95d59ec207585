"""What a lab's searches for the threshold, and pulses over the curve, teach of its people's responses."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from isiw import priors
from isiw.devices.info import DeviceInfo
from isiw.errors import DamagedLogError, LogError
from isiw.models.particles.prior import Prior
from isiw.priors.comparison import compared
from isiw.priors.lab import LabPrior
from isiw.session import open_threshold
from isiw.strategy.threshold import IntensityRange, make_threshold_search
from known import known
from logs import damage
from priors.logged import write_log

LARGEST = "largest MEP / floor"
SPACE = IntensityRange(20, 100)
OVER_PCT_MSO = tuple(range(45, 78, 4))


def searched(
    log: Path, seed: int, *, subject: str | None = None, muscle: str = "", simulated: bool = False, each: int = 2
) -> Path:
    """Pulses over the curve of a person with MEPs of 6 mV at most, a floor of 10 µV, and 50 µV at 50 % MSO."""
    rng = np.random.default_rng([seed, 69])
    largest = 600.0 * math.exp(0.2 * rng.standard_normal())
    search = make_threshold_search("curve", SPACE, at_pct_mso=OVER_PCT_MSO, each=each, seed=seed)
    device = DeviceInfo("bench", "valve", simulated=simulated)
    subject = f"P{seed}" if subject is None else subject
    with open_threshold(search, log, device=device, min_iti_s=0, subject=subject, muscle=muscle) as session:
        while not session.decision().stop:
            drive = 0.5 * (session.ask() - 59.0) + 1.0 * rng.standard_normal()
            evoked = largest / (1.0 + math.exp(-drive)) * math.exp(0.3 * rng.standard_normal())
            session.tell(0.01 * (math.exp(0.2 * rng.standard_normal()) + evoked))
    return log


def largest(lab: LabPrior) -> tuple[float, float]:
    """Median of the largest MEP over the floor in the next person of the lab, and in people in general."""
    row = compared(lab).to_dict("index")[LARGEST]
    return row["lab median"], row["built-in median"]


@pytest.mark.slow
def test_pulses_over_the_curve_teach_what_the_labs_curves_are_like_and_few_people_change_little(tmp_path: Path) -> None:
    logs = [searched(tmp_path / f"{seed}.mcap", seed) for seed in range(5)]
    two, all_of = priors.learn(logs[:2]), priors.learn(logs)
    (first, usual), (last, _) = largest(two), largest(all_of)
    assert usual <= first < last
    assert last > 3 * usual
    assert known(all_of.muscle).share > (two.muscle.share if two.muscle else 0.0)
    assert math.log(known(all_of.muscle).ratio.median) == pytest.approx(math.log(600), abs=0.9)
    assert [session.trials for session in all_of.sessions] == [2 * len(OVER_PCT_MSO)] * 5


@pytest.mark.usefixtures("few_sweeps")
def test_pulses_of_tms_alone_teach_nothing_of_windows_and_kinds_of_noise(tmp_path: Path) -> None:
    lab = priors.learn([searched(tmp_path / f"{seed}.mcap", seed, each=1) for seed in range(2)])
    usual = Prior()
    assert lab.place is None
    assert lab.gain is None
    assert lab.p_window == pytest.approx(usual.profile.p_window, abs=0.12)  # few sweeps are noisy
    assert lab.noise.constant_cv == pytest.approx(usual.noise.constant_cv, abs=0.12)


@pytest.mark.usefixtures("few_sweeps")
def test_a_search_and_a_session_of_one_person_are_one_person(tmp_path: Path) -> None:
    session = write_log(tmp_path / "s.mcap", trials=3, subject="P1")
    lab = priors.learn([session, searched(tmp_path / "t.mcap", 1, each=1)])
    assert [each.subject for each in lab.sessions] == ["P1", "P1"]
    assert lab.floor is None  # of one person no law is made, of two there is


def test_a_search_that_does_not_belong_to_the_others_is_refused(tmp_path: Path) -> None:
    session = write_log(tmp_path / "s.mcap", trials=3)
    for name, other, said in (
        ("nobody", {"subject": ""}, "does not say of whom"),
        ("simulated", {"simulated": True}, "some of the sessions are simulated"),
    ):
        with pytest.raises(LogError, match=said):
            priors.learn([session, searched(tmp_path / f"{name}.mcap", 2, each=1, **other)])
    with pytest.raises(LogError, match="different muscles"):
        priors.learn([searched(tmp_path / f"{name}.mcap", 3, each=1, muscle=name) for name in ("FCR", "FDI")])
    broken = searched(tmp_path / "broken.mcap", 4, each=1)
    damage(broken)
    with pytest.raises(DamagedLogError, match="damaged"):
        priors.learn([broken])
