"""The parametric window model as a Pyro program: every inference draws on its two distributions and no other.

latents ~ Normal(0, 1)
log MEP of each trial ~ MepLaw(what the latents mean, ISI of the trial)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from isiw.design import DesignSpace
from isiw.lazy import pyro, torch
from isiw.models import parametric
from isiw.models.parametric.prior import Likelihood, Unknowns, WindowPrior, latent_names
from isiw.models.protocol import Tensor
from isiw.models.shared.history import History

TREE_DEPTH: Final = 6
"""Latents are of the order of one: 63 leaps reach far enough, and a chain between two modes stays affordable."""


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
        """Run the program."""
        latents = pyro.sample("latents", self._latents())
        unknowns = self.unknowns(latents)
        for name in ("start_ms", "width_ms", "baseline_mv", "amplitude_mv"):
            pyro.deterministic(name, getattr(unknowns, name))
        with pyro.plate("trials", trials.isi_ms.shape[-1]):
            pyro.sample("log_mep", self._meps(unknowns, trials), obs=_ends(trials))
        return unknowns

    def log_density(self, latents: Tensor, trials: History) -> Tensor:
        """What the trace of the program sums to for each of many latents (m, d), shape (m,)."""
        prior: Tensor = self._latents().log_prob(latents)
        return prior + self.log_likelihood(latents, trials)

    def log_likelihood(self, latents: Tensor, trials: History) -> Tensor:
        """Log likelihood of the trials under each of many latents (m, d), shape (m,)."""
        return self._meps(self.unknowns(latents), trials).log_prob(_ends(trials)).sum(-1)

    def unknowns(self, latents: Tensor) -> Unknowns:
        """What latents (..., d) mean."""
        return self.prior.unknowns(latents, self.likelihood, self.space)

    def _latents(self) -> pyro.distributions.Independent:
        return pyro.distributions.Independent(
            pyro.distributions.Normal(torch.zeros(self.latents, dtype=torch.double), 1.0), 1
        )

    def _meps(self, unknowns: Unknowns, trials: History) -> parametric.MepLaw:
        return parametric.MepLaw(unknowns, trials.isi_ms[0], trials.isi_sd_ms[0], self.likelihood, present=self.present)


def _ends(trials: History) -> Tensor:
    return torch.stack((trials.log_mep[0], trials.log_mep_high[0]), dim=-1)


def nuts_sample(
    program: WindowProgram, trials: History, starts: Tensor, draws: int, warmup: int, generator: torch.Generator
) -> Tensor:
    """Draw from the posterior of a program by the no-U-turn sampler: slow, for reference."""
    chains = []
    with torch.random.fork_rng(devices=[]):
        # Pyro draws from torch's global stream.
        torch.manual_seed(int(torch.randint(2**31, (1,), generator=generator)))
        for start in starts:
            kernel = pyro.infer.NUTS(program, full_mass=True, max_tree_depth=TREE_DEPTH)
            mcmc = pyro.infer.MCMC(
                kernel, draws, warmup_steps=warmup, initial_params={"latents": start}, disable_progbar=True
            )
            mcmc.run(trials)
            chains.append(mcmc.get_samples()["latents"])
    return torch.stack(chains)
