"""What the conformance suites share: promises, and trials that break things."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.text.sanitize import shown

Trials = tuple[tuple[float | None, float], ...]
"""ISIs [ms] (None is TMS alone) and MEPs [mV], in the order of telling."""

_USUAL_SHARES: Final = (0.0, 0.25, 0.5, 0.75, 1.0, 0.4, 0.6, 0.45, 0.55, 0.5, 0.35, 0.65)


def require(condition: object, promise: str, seen: str = "") -> None:
    """Raise where a promise is broken."""
    if not condition:
        raise broken(promise, seen)


def broken(promise: str, seen: str) -> AssertionError:
    """That a promise is broken, as an error whose message sets what was found against what must hold."""
    return AssertionError(f"check failed. Required: {promise}{f'; found: {seen}' if seen else ''}")


def usual_trials(space: DesignSpace) -> Trials:
    """Trials of a person whose window lies in the middle of the space."""
    isis_ms = [space.snap(space.low_ms + share * (space.high_ms - space.low_ms)) for share in _USUAL_SHARES]
    meps_mv = [0.01 + 0.1 * float(np.exp(-0.5 * ((share - 0.5) / 0.08) ** 2)) for share in _USUAL_SHARES]
    return tuple(zip(isis_ms, meps_mv, strict=True))


def trials_that_break_things(space: DesignSpace, trials: int = 12) -> Mapping[str, Trials]:
    """Trials by what is odd about them."""
    low, high = space.low_ms, space.high_ms
    isis_ms = [space.snap(isi_ms) for isi_ms in np.linspace(low, high, trials)]
    middle = isis_ms[trials // 2]
    return {
        "no trials": (),
        "two trials only": ((low, 0.01), (middle, 0.1)),
        "baselines only": ((None, 0.01), (None, 0.02), (None, 0.0)),
        "all MEPs equal": tuple((isi_ms, 0.05) for isi_ms in isis_ms),
        "all MEPs zero": tuple((isi_ms, 0.0) for isi_ms in isis_ms),
        "one huge outlier": tuple((isi_ms, 25.0 if isi_ms == isis_ms[3] else 0.01) for isi_ms in isis_ms),
        "the same ISI again and again": tuple((middle, 0.01 + 0.01 * (k % 5)) for k in range(trials)),
        "both ends only": tuple(((low, high)[k % 2], (0.01, 0.3)[k % 2]) for k in range(trials)),
        "beyond the range": ((low - 0.9 * space.tolerance_ms, 0.01), (high + 0.9 * space.tolerance_ms, 0.02)),
    }


def check_estimate(estimate: object, space: DesignSpace, when: str) -> None:
    """Check that an estimate of the window can be used."""
    require(isinstance(estimate, WindowEstimate), f"an estimate is a WindowEstimate {when}", shown(estimate))
    if not isinstance(estimate, WindowEstimate):
        return
    if estimate.window is not None:
        inside = space.low_ms <= estimate.window.start_ms <= estimate.window.end_ms <= space.high_ms
        require(inside, f"the reported window lies in the space {when}", str(estimate.window))
    if estimate.edge_samples_ms is not None:
        shape = estimate.edge_samples_ms.shape
        require(len(shape) == 2 and shape[1] == 2, f"samples of the edges have the shape (s, 2) {when}", str(shape))
        require(not np.isnan(estimate.edge_samples_ms).any(), f"no sample of an edge is NaN {when}")
    if estimate.profile_quantiles_mv is not None:
        require(np.isfinite(estimate.profile_quantiles_mv).all(), f"the profile is finite {when}")
        require((np.diff(estimate.profile_quantiles_mv, axis=0) >= -1e-9).all(), f"its quantiles ascend {when}")


def same_estimates(one: WindowEstimate, other: WindowEstimate) -> bool:
    """True if two estimates are the same to the last bit."""
    arrays = ("grid_ms", "edge_samples_ms", "profile_quantiles_mv", "hypothesis_samples")
    plain = ("probability", "window", "start_ms", "end_ms", "spread_ms", "expected_f1", "best_isi", "largest_excluded")
    return all(getattr(one, name) == getattr(other, name) for name in plain) and all(
        np.array_equal(np.asarray(getattr(one, name)), np.asarray(getattr(other, name))) for name in arrays
    )
