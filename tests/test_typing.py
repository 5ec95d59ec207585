"""What type checkers see of the public surface."""

from __future__ import annotations

from pathlib import Path

import pytest
from mypy import api

import isiw

SNIPPET = """\
import isiw
reveal_type(isiw.Session)
reveal_type(isiw.make_strategy)
reveal_type(isiw.strategy.stopping.Budget)
reveal_type(isiw.list_strategies())
isiw.Windwo
"""


@pytest.mark.slow
def test_the_public_names_are_the_classes_and_functions_themselves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MYPYPATH", str(Path(isiw.__path__[0]).parent))
    alone = ("--no-site-packages", "--ignore-missing-imports", "--follow-imports=silent", "--config-file=")
    output, errors, _ = api.run([*alone, f"--cache-dir={tmp_path}", "--no-error-summary", "-c", SNIPPET])
    assert errors == ""
    session, make_strategy, budget, strategies, unknown = output.splitlines()
    assert 'Revealed type is "def (device: isiw.devices.protocol.Device, strategy:' in session
    assert session.endswith('-> isiw.session.loop.Session"')
    assert make_strategy.endswith('-> isiw.strategy.strategy.Strategy"')
    assert budget.endswith('"def (max_trials: int) -> isiw.strategy.stopping.Budget"')
    assert strategies.endswith('"dict[str, str]"')
    assert 'Module has no attribute "Windwo"' in unknown
