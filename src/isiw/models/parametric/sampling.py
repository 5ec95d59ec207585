"""From one person's trials to equally weighted draws of the parametric window model, with and without a window."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Final

from isiw.checks import Checked, Count, number
from isiw.design import DesignSpace
from isiw.lazy import pyro, torch
from isiw.models import parametric
from isiw.models.parametric.importance import Effort, Modes, Proposal, WeightedDraws, importance_sample, worth
from isiw.models.parametric.law import Likelihood, Unknowns, WindowPrior, latent_names
from isiw.models.parametric.normal import log_standard
from isiw.models.parametric.tensors import Tensor, Trials
from isiw.models.shared.draws import systematic

LIKELIHOODS_AT_ONCE: Final = 8000
"""Likelihoods of a trial that are worked out at once: more than these do not stay in a processor's cache."""

TREE_DEPTH: Final = 6
"""Latents are of the order of one: 63 leaps reach far enough, and a chain between two modes stays affordable."""


@dataclass(frozen=True)
class WindowProgram:
    """The model of one person in a design space, with a window or without; calling it runs it as a Pyro program."""

    prior: WindowPrior
    likelihood: Likelihood
    space: DesignSpace
    present: bool = True

    @property
    def latents(self) -> int:
        """Number of latents."""
        return len(latent_names(self.likelihood))

    def __call__(self, trials: Trials) -> Unknowns:
        """Run the program."""
        standard = pyro.distributions.Normal(torch.zeros(self.latents, dtype=torch.double), 1.0)
        latents = pyro.sample("latents", pyro.distributions.Independent(standard, 1))
        unknowns = self.unknowns(latents)
        for name in ("start_ms", "width_ms", "baseline_mv", "amplitude_mv"):
            pyro.deterministic(name, getattr(unknowns, name))
        with pyro.plate("trials", len(trials.isi_ms)):
            pyro.sample("log_mep", self._meps(unknowns, trials), obs=trials.log_mep)
        return unknowns

    def log_density(self, latents: Tensor, trials: Trials) -> Tensor:
        """Log density of the program's trace for each of many latents (m, d), shape (m,)."""
        few = max(LIKELIHOODS_AT_ONCE // max(len(trials.isi_ms), 1), 1)
        log_likelihood = [self.log_likelihood(part, trials) for part in torch.split(latents, few)]
        return log_standard(latents) + torch.cat(log_likelihood)

    def log_likelihood(self, latents: Tensor, trials: Trials) -> Tensor:
        """Log likelihood of the trials under each of many latents (m, d), shape (m,)."""
        return self._meps(self.unknowns(latents), trials).log_prob(trials.log_mep).sum(-1)

    def unknowns(self, latents: Tensor) -> Unknowns:
        """The unknowns that latents (..., d) stand for."""
        return self.prior.unknowns(latents, self.likelihood, self.space)

    def _meps(self, unknowns: Unknowns, trials: Trials) -> parametric.MepLaw:
        return parametric.MepLaw(unknowns, trials.isi_ms, trials.isi_sd_ms, self.likelihood, present=self.present)


def nuts_sample(
    program: WindowProgram, trials: Trials, starts: Tensor, draws: int, warmup: int, generator: torch.Generator
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


WITHOUT_WINDOW: Final = Effort(scouts=256, starts=2, steps=15, draws=300, enough=200.0)
"""Without a window few latents matter, and there is one mode."""

LEAST_WORTH: Final = 50.0
"""Draws that are worth fewer independent ones than this are trouble."""


@dataclass(frozen=True)
class Chains(Checked):
    """Settings of the no-U-turn sampler.

    Args:
        warmup: draws for adaptation.
        least: a chain has at least so many draws after them.
        least_share: modes with a smaller share of the evidence get no chain.
        max_r_hat: chains that disagree by more [Gelman1992] are trouble.
    """

    warmup: Count = 150
    least: Count = 50
    least_share: Annotated[float, partial(number, least=0, below=1)] = 0.05
    max_r_hat: Annotated[float, partial(number, above=1)] = 1.1


@dataclass(frozen=True, eq=False)
class PersonDraws:
    """Equally weighted draws of one person's posterior: latents, shape (s, d), and which have a window, shape (s,)."""

    latents: Tensor
    present: Tensor
    log_evidence: float
    trouble: str | None


def sample_person(
    program: WindowProgram,
    trials: Trials,
    samples: int,
    effort: Effort,
    generator: torch.Generator,
    chains: Chains | None = None,
) -> PersonDraws:
    """Draw from the posterior of one person."""
    everywhere = Proposal.prior(program.latents)
    log_density = partial(program.log_density, trials=trials)
    log_density_without = partial(replace(program, present=False).log_density, trials=trials)
    without = importance_sample(log_density_without, everywhere, generator, WITHOUT_WINDOW)
    # Without a window its place and size are as in the prior, and the floor is already known: good scouts.
    with_ = importance_sample(log_density, Proposal.at(without.modes), generator, effort)
    models = (with_, without)
    prior = torch.tensor([program.prior.p_window, 1.0 - program.prior.p_window], dtype=torch.double)
    log_joint = torch.tensor([model.log_evidence for model in models], dtype=torch.double) + prior.log()
    log_shares = torch.log_softmax(log_joint, dim=0)
    flattened = [
        _flattened(model, float(share), which)
        for model, share, which in zip(models, log_shares, ("with", "without"), strict=True)
    ]
    kept, troubles = zip(*flattened, strict=True)
    log_weights = torch.cat([model.log_weights + share for model, share in zip(kept, log_shares, strict=True)])
    picks = torch.from_numpy(systematic(log_weights.numpy()[None], samples)[0])
    latents, present = torch.cat([model.points for model in kept])[picks], picks < len(kept[0].points)
    # Without trials there is nothing to climb, and Pyro knows no empty plate.
    if chains is not None and bool(present.any()) and trials.isi_ms.numel():
        latents[present], disagree = _by_nuts(program, trials, with_.modes, int(present.sum()), chains, generator)
        troubles = (*troubles, disagree)
    trouble = " ".join(sentence for sentence in troubles if sentence)
    return PersonDraws(latents, present, float(torch.logsumexp(log_joint, dim=0)), trouble or None)


def _flattened(drawn: WeightedDraws, log_share: float, which: str) -> tuple[WeightedDraws, str | None]:
    """The draws, their weights raised to the power below 1 that makes them worth enough; and why, if they were not."""
    before = worth(drawn.log_weights)
    if before >= LEAST_WORTH or log_share < math.log(0.01):
        return drawn, None
    low, high = 0.0, 1.0
    for _ in range(30):
        power = 0.5 * (low + high)
        flatter = replace(drawn, log_weights=torch.log_softmax(power * drawn.log_weights, dim=0))
        low, high = (power, high) if worth(flatter.log_weights) >= LEAST_WORTH else (low, power)
    return flatter, (
        f"The sample {which} a window is worth {before:.0f} independent draws only; its weights were flattened until "
        f"it was worth {LEAST_WORTH:.0f}, so that the posterior is rough."
    )


def _by_nuts(
    program: WindowProgram, trials: Trials, modes: Modes, size: int, chains: Chains, generator: torch.Generator
) -> tuple[Tensor, str | None]:
    """Draws by NUTS from each mode, by its evidence, as chains may not mix, and a sentence if they disagree."""
    shares = torch.softmax(modes.log_evidence, dim=0)
    shares = shares[shares >= chains.least_share]
    length = max(chains.least, size // len(shares))
    drawn = nuts_sample(program, trials, modes.points[: len(shares)], length, chains.warmup, generator)
    log_weights = (shares / shares.sum() / length).log().repeat_interleave(length)
    picks = torch.from_numpy(systematic(log_weights.numpy()[None], size)[0])
    r_hat = _r_hat(drawn[..., :2])
    disagree = None
    if r_hat > chains.max_r_hat:
        disagree = f"The chains of NUTS disagree (R-hat {r_hat:.2f}); each counts by the evidence of its mode."
    return drawn.flatten(0, 1)[picks], disagree


def _r_hat(chains: Tensor) -> float:
    """The largest potential scale reduction of chains (c, draws, d) that are split in halves."""
    half = chains.shape[1] // 2
    halves = torch.cat((chains[:, :half], chains[:, half : 2 * half]))
    within, between = halves.var(dim=1).mean(0), halves.mean(dim=1).var(dim=0)
    return float(torch.sqrt(1.0 + between / within.clamp_min(1e-12)).max())
