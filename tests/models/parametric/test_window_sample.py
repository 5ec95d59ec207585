"""What samples say about the window is what the rule says of their expected MEPs."""

import numpy as np
import pytest
import torch

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.excess import window_from_excess
from isiw.metrics import f1
from isiw.models.parametric import ParametricModel
from isiw.models.parametric.model import WindowSample
from isiw.window import Window


@pytest.mark.parametrize("space", [VALVE_SPACE, DesignSpace(0, 300, reference="valve")], ids=["whole", "cut off"])
def test_windows_are_those_of_the_rule_also_where_the_peak_lies_beyond_the_range(space: DesignSpace) -> None:
    model = ParametricModel()
    program = model.program(space)
    latents = torch.randn((1, 500, program.latents), generator=torch.Generator().manual_seed(3), dtype=torch.double)
    sample = WindowSample(program.unknowns(latents), torch.ones((1, 500), dtype=torch.bool), model.likelihood, space)
    grid_ms = torch.tensor(space.grid_ms)
    baselines_mv = sample.unknowns.baseline_mv[0].tolist()
    pairs = [
        (Window.from_mask(space.grid_ms, mask), window_from_excess(space.grid_ms, mep_mv - baseline_mv, baseline_mv))
        for mask, mep_mv, baseline_mv in zip(
            sample.window_masks(grid_ms)[0].numpy(), sample.profiles_mv(grid_ms)[0].numpy(), baselines_mv, strict=True
        )
    ]
    scores = np.array([f1(ours, rules, space) for ours, rules in pairs])
    assert (scores > 0).mean() > 0.995  # none against one: excesses within a hair of the least that counts
    assert np.quantile(scores[scores > 0], 0.01) > 0.97
