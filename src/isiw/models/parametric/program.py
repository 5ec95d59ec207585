"""The parametric window model as a Pyro program: every inference draws on its two distributions and no other.

latents ~ Normal(0, 1)
log MEP of each trial ~ MepLaw(what the latents mean, ISI of the trial)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final

import pyro
import torch
from pyro.distributions import Independent, Normal
from pyro.distributions.torch_distribution import TorchDistribution
from pyro.infer import MCMC, NUTS
from torch.distributions import constraints

from isiw.design import DesignSpace
from isiw.models.parametric.law import draw_log_mep, levels, log_likelihood
from isiw.models.parametric.prior import Likelihood, Unknowns, WindowPrior, latent_names
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History
from isiw.models.shared.tables import ISI_NODES

__all__ = ["MepLaw", "WindowProgram", "nuts_sample"]

TREE_DEPTH: Final = 6
"""Latents are of the order of one: 63 leaps reach far enough, and a chain between two modes stays affordable."""


class MepLaw(TorchDistribution):
    """Distribution of the natural logs of one person's MEPs [mV], as intervals that are points where one is known.

    Args:
        unknowns: fields of shape (m,) or ().
        isi_ms: ISIs [ms], NaN for TMS alone, shape (n,).
        isi_sd_ms: SDs of the ISIs [ms], shape (n,).
        likelihood: the likelihood.
        present: whether there is a window at all.
    """

    arg_constraints: ClassVar[dict[str, Any]] = {}
    support = constraints.independent(constraints.real, 1)

    def __init__(
        self, unknowns: Unknowns, isi_ms: Tensor, isi_sd_ms: Tensor, likelihood: Likelihood, *, present: bool = True
    ) -> None:
        self.unknowns, self.isi_ms, self.isi_sd_ms = unknowns, isi_ms, isi_sd_ms
        self.likelihood, self.present = likelihood, present
        # An interval may reach to infinity, which the support of Pyro's checks cannot express.
        super().__init__(torch.Size((*unknowns.start_ms.shape, len(isi_ms))), torch.Size((2,)), validate_args=False)

    def log_prob(self, value: Tensor) -> Tensor:
        """Log density of each log MEP, or log probability of its interval (n, 2), shape (m, n)."""
        if not self.present:
            nowhere = torch.zeros_like(self.unknowns.start_ms).unsqueeze(-1)
            return log_likelihood(self.unknowns, nowhere, value, self.likelihood)
        if not bool((self.isi_sd_ms > 0).any()):
            return self._log_prob_at(self.isi_ms, value)
        nodes = [
            self._log_prob_at(self.isi_ms + shift * self.isi_sd_ms, value) + math.log(weight)
            for shift, weight in ISI_NODES
        ]
        return torch.logsumexp(torch.stack(nodes), dim=0)

    def _log_prob_at(self, isi_ms: Tensor, value: Tensor) -> Tensor:
        return log_likelihood(self.unknowns, levels(self.unknowns, isi_ms), value, self.likelihood)

    def sample(self, sample_shape: Sequence[int] = ()) -> Tensor:
        """Log MEPs as points, shape (..., m, n, 2)."""
        unknowns = Unknowns(*(x.expand((*sample_shape, *x.shape)) for x in self.unknowns))
        level = levels(unknowns, self.isi_ms + self.isi_sd_ms * torch.randn_like(self.isi_sd_ms))
        log_mep = draw_log_mep(unknowns, level if self.present else torch.zeros_like(level), self.likelihood)
        return torch.stack((log_mep, log_mep), dim=-1)


@dataclass(frozen=True)
class WindowProgram:
    """The model of one person in a design space; calling it runs it as a Pyro program.

    Args:
        prior: the prior over people.
        likelihood: the likelihood.
        space: the design space.
        present: whether there is a window at all.
    """

    prior: WindowPrior
    likelihood: Likelihood
    space: DesignSpace
    present: bool = True

    @property
    def latents(self) -> int:
        """How many latents there are."""
        return len(latent_names(self.likelihood))

    def without_window(self) -> WindowProgram:
        """The model of the same person, given that there is no window."""
        return replace(self, present=False)

    def __call__(self, trials: History) -> Unknowns:
        """Run the program.

        Args:
            trials: of one person, columns of shape (1, n); their MEPs are observed.
        """
        latents = pyro.sample("latents", self._latents())
        unknowns = self.unknowns(latents)
        for name in ("start_ms", "width_ms", "baseline_mv", "amplitude_mv"):
            pyro.deterministic(name, getattr(unknowns, name))
        with pyro.plate("trials", trials.isi_ms.shape[-1]):
            pyro.sample("log_mep", self._meps(unknowns, trials), obs=_ends(trials))
        return unknowns

    def log_density(self, latents: Tensor, trials: History) -> Tensor:
        """What the trace of the program sums to for each of many latents (m, d), shape (m,).

        Args:
            latents: the latents, shape (m, d).
            trials: of one person.
        """
        prior: Tensor = self._latents().log_prob(latents)
        return prior + self.log_likelihood(latents, trials)

    def log_likelihood(self, latents: Tensor, trials: History) -> Tensor:
        """Log likelihood of the trials under each of many latents (m, d), shape (m,).

        Args:
            latents: the latents, shape (m, d).
            trials: of one person.
        """
        return self._meps(self.unknowns(latents), trials).log_prob(_ends(trials)).sum(-1)

    def unknowns(self, latents: Tensor) -> Unknowns:
        """What latents (..., d) mean."""
        return self.prior.unknowns(latents, self.likelihood, self.space)

    def _latents(self) -> Independent:
        return Independent(Normal(torch.zeros(self.latents, dtype=torch.double), 1.0), 1)

    def _meps(self, unknowns: Unknowns, trials: History) -> MepLaw:
        return MepLaw(unknowns, trials.isi_ms[0], trials.isi_sd_ms[0], self.likelihood, present=self.present)


def _ends(trials: History) -> Tensor:
    return torch.stack((trials.log_mep[0], trials.log_mep_high[0]), dim=-1)


def nuts_sample(
    program: WindowProgram, trials: History, starts: Tensor, draws: int, warmup: int, generator: torch.Generator
) -> Tensor:
    """Draw from the posterior of a program by the no-U-turn sampler: slow, for reference.

    Args:
        program: the model.
        trials: of one person, columns of shape (1, n).
        starts: a chain begins at each of these latents, shape (c, d).
        draws: kept draws of each chain.
        warmup: draws before them, for adaptation.
        generator: source of randomness.

    Returns:
        Latents, shape (c, draws, d).
    """
    chains = []
    with torch.random.fork_rng(devices=[]):
        # Pyro draws from torch's global stream.
        torch.manual_seed(int(torch.randint(2**31, (1,), generator=generator)))
        for start in starts:
            kernel = NUTS(program, full_mass=True, max_tree_depth=TREE_DEPTH)
            mcmc = MCMC(kernel, draws, warmup_steps=warmup, initial_params={"latents": start}, disable_progbar=True)
            mcmc.run(trials)
            chains.append(mcmc.get_samples()["latents"])
    return torch.stack(chains)
