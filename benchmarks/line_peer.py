"""Sessions with an instrument over TCP that lies, stalls and hangs up: is anything lost, or given twice?

    python -m benchmarks.line_peer --sessions 1000 > benchmarks/results/line_peer.md

Each session has a peer (`benchmarks/pulse_peer.py`) on the loopback that meets a share of all commands with a lie, and
keeps a ledger of what it gave. What ends a session is resumed, with a new `isiw.LineDevice`, until its stimuli are used
up. Then ledger and log are compared pair by pair, and each MEP that counts with the one that belongs to what was given.
It is the line that is tried, so the strategy costs next to nothing, and depends on all it was told.
"""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import track

import isiw
from benchmarks.faulty_device import check_ledger
from benchmarks.provenance import command_of, made_with
from benchmarks.pulse_peer import PEER_COMMANDS, Lie, PulsePeer
from benchmarks.quick import understood
from benchmarks.remembering import SPACE, answer, strategy

MOST_RUNS = 100
LINE = {"timeout_s": 0.1, "connect_s": 1.0}
TIMEOUT_S = 0.4
GUARDS = isiw.Safeguards(deadlines=isiw.Deadlines(stop_s=3.0, stop_attempts=5), retries=2, backoff_s=0.0)


def mep_mv(isi_ms: float | None) -> float:
    """The MEP that belongs to an ISI [mV]."""
    return answer(isiw.Stimulus(0, isi_ms), 0.0).mep_mv


def run(log: Path, seed: int, trials: int, rate: float) -> tuple[PulsePeer, Counter[str]]:
    """Run and resume one session until its stimuli are used up, and check it; the peer, and what happened."""
    peer = PulsePeer(seed, rate=rate, respond=mep_mv)
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0.0, max_pulses=trials)
    runs = 0
    with peer.over_tcp() as address:
        while not ended(log, trials):
            runs += 1
            if runs > MOST_RUNS:
                sys.exit(f"session {seed} does not end")
            with suppress(isiw.errors.IsiwError):  # what the peer did; the log must stand it
                session(log, address, seed, limits).run()
            if peer.armed:
                sys.exit(f"session {seed} ended armed")
    record = isiw.read_session(log)
    check(peer, record, limits)
    return peer, counted(record) + Counter(runs=runs, fired=len(peer.ledger))


def ended(log: Path, trials: int) -> bool:
    """Whether all stimuli are used up."""
    return log.exists() and len(isiw.read_session(log).table) >= trials


def session(log: Path, address: str, seed: int, limits: isiw.Limits) -> isiw.Session:
    """The session, new or resumed, with a new device."""
    device = isiw.LineDevice(address, {"name": "peer", "reference": SPACE.reference}, PEER_COMMANDS, LINE)
    chosen = strategy(limits.max_pulses, seed)
    if log.exists():
        return isiw.resume(log, device, chosen, limits=limits, timeout_s=TIMEOUT_S, safeguards=GUARDS)
    return isiw.Session(device, chosen, log=log, limits=limits, timeout_s=TIMEOUT_S, safeguards=GUARDS)


def check(peer: PulsePeer, record: isiw.SessionRecord, limits: isiw.Limits) -> None:
    """End the program where anything is lost, given twice, or counts with what does not belong to it."""
    if record.losses or not record.finished:
        sys.exit(f"the log {record.path} is damaged: {record.losses}")
    commanded = {intent.trial: intent.isi_ms for intent in record.intents}
    meant = [
        replace(fired, isi_ms=commanded[fired.trial]) if fired.trial in peer.wrong_isis else fired
        for fired in peer.ledger
    ]
    check_ledger(meant, record, limits)
    given_ms = {fired.trial: fired.isi_ms for fired in peer.ledger}
    for trial in record.table.told:
        if trial.index in peer.wrong_isis:
            sys.exit(f"trial {trial.index} of {record.path} counts, and another ISI was given")
        if trial.isi_ms != given_ms[trial.index] or abs((trial.mep_mv or 0.0) - mep_mv(trial.isi_ms)) > 1e-5:
            sys.exit(f"trial {trial.index} of {record.path} counts with an answer to another one")


def counted(record: isiw.SessionRecord) -> Counter[str]:
    """What is in a log."""
    refused = sum(event.kind == "refused" for event in record.events)
    return Counter(sessions=1, trials=len(record.table), told=len(record.table.told), refused=refused)


def report(counts: Counter[str], lies: Counter[Lie], trials: int, first: int, spent_s: float) -> None:
    """Print the counts."""
    print(f"- command: `{command_of('line_peer')}`")
    print(f"- {made_with('mcap', 'numpy', 'torch')}\n")
    print(
        f"{counts['sessions']:,} sessions of {trials} trials (seeds {first} to {first + counts['sessions'] - 1}) over "
        f"TCP on the loopback, run {counts['runs']:,} times in all, in {spent_s / 60:.1f} minutes: "
        f"{counts['fired']:,} stimuli given, {counts['trials']:,} trials logged, {counts['told']:,} of them told, "
        f"{counts['refused']:,} refusals. None given without an intent before it, none twice, none missing in a log, "
        "none told with an ISI or an MEP that is not its own, no log damaged, no run left the peer armed.\n"
    )
    print("| what the peer did | times |\n|---|---|")
    for lie in Lie:
        print(f"| {lie} | {lies[lie]:,} |")


def main() -> None:
    """Run the sessions and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=1000)
    parser.add_argument("--trials", type=int, default=8)
    parser.add_argument("--rate", type=float, default=0.06, help="share of commands that meet a lie")
    parser.add_argument("--seed", type=int, default=0, help="the first session's")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    logging.getLogger("isiw.devices.transports").setLevel(logging.ERROR)  # what is thrown away is meant to be there
    counts, lies, began_s = Counter[str](), Counter[Lie](), time.monotonic()
    seeds = range(arguments.seed, arguments.seed + arguments.sessions)
    with tempfile.TemporaryDirectory() as folder:
        for seed in track(seeds, "trying", console=Console(stderr=True)):
            log = Path(folder) / f"{seed}.mcap"
            peer, happened = run(log, seed, arguments.trials, arguments.rate)
            log.unlink()
            counts, lies = counts + happened, lies + peer.happened
    report(counts, lies, arguments.trials, arguments.seed, time.monotonic() - began_s)


if __name__ == "__main__":
    understood("line_peer", prints=True)
    main()
