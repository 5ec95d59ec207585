"""A process that answers in a folder: `python -m devices.transports.folder_rig FOLDER FAULTS [--waveforms]`.

FAULTS is JSON: what is wrong with each trial, by its number; "arm" and "disarm" may be there, too.
"""

from __future__ import annotations

import json
import math
import random
import sys
import time
from pathlib import Path

from devices.transports.lies import Values, answer

RATE_HZ, SAMPLES, T_TMS_MS = 2000.0, 1400, 600.0


def read(place: Path) -> Values | None:
    """The request that is there; None where it is not whole."""
    try:
        lines = (place / "request.txt").read_text("utf-8").splitlines()
    except FileNotFoundError:
        return None
    pairs = [line.partition("=") for line in lines[:-1]]
    return {key: value for key, _, value in pairs} if lines[-1:] == ["end"] else None


def write(path: Path, text: str) -> None:
    """A file in one step."""
    beside = path.with_suffix(".new")
    beside.write_text(text, "utf-8")
    beside.rename(path)


def measured(request: Values, lie: str) -> Values:
    """What an answer has besides, where the rig measures the MEP itself."""
    values: Values = {
        "mep_mv": "0,4"
        if lie == "a decimal comma"
        else "nan"
        if lie == "a NaN MEP"
        else 0.4 + 0.05 * (int(request["trial"]) % 5)
    }
    if lie == "no MEP":
        values = {}
    if lie == "an enormous MEP":
        values = {"mep_mv": 4000}
    late_ms = 1000.0 if lie == "another realised ISI" else 0.1
    return values | ({"isi_ms": float(request["isi_ms"]) + late_ms} if "isi_ms" in request else {})


def waveforms(request: Values, lie: str) -> str:
    """EMG at rest, an MEP after the pulse, and a force."""
    rng = random.Random(int(request["trial"]))  # noqa: S311 - noise
    since_ms = [1e3 * sample / RATE_HZ - T_TMS_MS for sample in range(SAMPLES)]
    emg = [0.4 * math.exp(-0.5 * ((t - 25) / 2) ** 2) + rng.gauss(0, 0.0015) for t in since_ms]
    lines = [f"{value:.6f};{0.5:.1f}" for value in emg]
    if lie == "too few samples":
        del lines[-1]
    if lie == "too few columns":
        lines = [line.partition(";")[0] for line in lines]
    if lie == "decimal commas":
        lines = [line.replace(".", ",") for line in lines]
    if lie == "text as samples":
        lines[700] = "overload;0"
    return "\n".join(lines)


def recorded(request: Values, lie: str, place: Path) -> Values:
    """What an answer has besides, where the rig records waveforms; they are written first."""
    if lie != "no waveforms":
        write(place / request["waveforms"], waveforms(request, lie))
    values: Values = {"rate_hz": 4000 if lie == "another rate" else 2000, "samples": SAMPLES, "t0_ms": 0.0}
    values |= {"t_tms_ms": T_TMS_MS}
    return values | ({"t_hit_ms": T_TMS_MS - float(request["isi_ms"])} if "isi_ms" in request else {})


def as_text(values: Values, lie: str) -> str:
    """An answer as it is written."""
    lines = [f"{key}={value}" for key, value in values.items()]
    if lie == "a key twice":
        lines.append("said=delivered")
    if lie == "a line without a sign":
        lines.append("all is well")
    text = "\ufeff" + "\n".join([*lines, "", "end", ""])
    if lie == "half-written":
        return text[: len(text) // 2]
    return text + "x" * 70_000 if lie == "too large" else text


def obey(request: Values, lie: str, place: Path, *, records: bool) -> None:
    """Answer one request."""
    values = answer(request, lie)
    if request["verb"] == "deliver":
        with (place / "ledger").open("a") as ledger:
            ledger.write(f"{request['trial']}\n")
        values |= recorded(request, lie, place) if records else measured(request, lie)
        if lie == "late":
            time.sleep(1.0)
    if lie != "silence":
        write(place / request["answer"], as_text(values, lie))


def main() -> None:
    """Answer until the folder is gone."""
    place, faults = Path(sys.argv[1]), json.loads(sys.argv[2])
    last: tuple[str, str] | None = None
    (place / "ready").touch()
    while (place / "ready").exists():
        request = read(place)
        if request is not None and (request["token"], request["number"]) != last:
            last = (request["token"], request["number"])
            fault = faults.get(request["trial"] if request["verb"] == "deliver" else request["verb"], "")
            obey(request, fault, place, records="--waveforms" in sys.argv)
        time.sleep(0.005)


if __name__ == "__main__":
    main()
