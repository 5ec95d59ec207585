"""What the benchmark does to a server in a process of its own, on a smaller scale."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from benchmarks.server_clients import shared
from benchmarks.server_strangers import operated_meanwhile, served_meanwhile
from benchmarks.server_tries import Served, fuzzed, killed

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="the server is a fork")


@pytest.mark.slow
def test_malformed_requests_neither_fail_the_server_nor_change_a_session(tmp_path: Path) -> None:
    with Served(tmp_path) as served:
        _, _, answers = fuzzed(served, 300, random.Random(1))  # noqa: S311 - no secret
    assert sum(answers.values()) == 300
    assert {"400", "401", "403", "404", "405", "413", "415", "422"} <= set(answers)


@pytest.mark.slow
def test_a_server_that_is_killed_at_random_loses_and_doubles_nothing(tmp_path: Path) -> None:
    assert "None is missing" in killed(tmp_path, 20, random.Random(1))  # noqa: S311 - no secret


@pytest.mark.slow
def test_whoever_has_the_token_is_answered_beside_many_who_have_not(tmp_path: Path) -> None:
    assert max(served_meanwhile(tmp_path, 150, 10)) < 1
    operated_s, reason = operated_meanwhile(tmp_path, 150, 2)
    assert max(operated_s) < 1
    assert "Ended on the live page" in reason


@pytest.mark.slow
def test_several_clients_of_one_session_never_deliver_a_trial_twice_or_too_early(tmp_path: Path) -> None:
    assert "each once; none that was delivered is missing" in shared(tmp_path, 5)
