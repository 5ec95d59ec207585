"""The example of the page runs as it stands there, but for its address and its pace."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from benchmarks.faulty_device import check_ledger
from benchmarks.pulse_peer import PulsePeer

import isiw
from isiw.config import RunConfig, load_config, session_for
from isiw.devices.transports.line_table import LineCommands

PAGE = (Path(__file__).parents[4] / "docs" / "lab" / "line.md").read_text(encoding="utf-8")
CHEAP = '[strategy]\nname = "random"\nsettings = { max_trials = 4, particles = 100 }\n'


def config_at(address: str, folder: Path, change: tuple[str, str] = ("", "")) -> RunConfig:
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    for old, new in (('"COM3"', f'"{address}"'), ("min_iti_s = 5.0", "min_iti_s = 0.0"), change):
        assert old in example
        example = example.replace(old, new) if old else example
    (folder / "session.toml").write_text(f"{example}\n{CHEAP}", encoding="utf-8")
    return load_config(folder / "session.toml").with_overrides(log=folder / "log.mcap")


def test_the_example_runs_a_session_from_a_configuration_alone(tmp_path: Path) -> None:
    peer = PulsePeer()
    with peer.over_tcp() as address:
        session_for(config_at(address, tmp_path)).run()
    record = isiw.read_session(tmp_path / "log.mcap")
    fired = [type(each)(trial, each.isi_ms, each.t_s) for trial, each in enumerate(peer.ledger)]  # it hears no numbers
    check_ledger(fired, record, isiw.Limits(0.0, 300.0, min_iti_s=0.0))
    assert len(record.table.told) == 4
    assert not peer.armed


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("disarm    =", "disarrm   ="), "disarrm"),
        (('name = "pulse generator"', 'nam = "pulse generator"'), "nam"),
        (("SET {isi_us}", "SET"), "must hold the ISI"),
    ],
)
def test_a_slip_in_the_configuration_is_named(tmp_path: Path, change: tuple[str, str], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        session_for(config_at("socket://127.0.0.1:1", tmp_path, change))


@pytest.mark.parametrize("name", LineCommands.__dataclass_fields__)
def test_the_page_has_every_command(name: str) -> None:
    assert f"| `{name}` |" in PAGE
