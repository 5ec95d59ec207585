"""The vane actuator against chapter 7 of the dissertation: the plane of sizes, the time courses, and what decides them.

    python -m benchmarks.vane --out benchmarks/results/vane

writes tables (Markdown), all figures with versions and command and the comparison with the text claim by claim (JSON),
and a picture of the plane. It takes one to two minutes on one core.
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from matplotlib.figure import Figure

from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.tables import write_tables
from benchmarks.vane_claims import FULL, claims_of
from isiw import Rotor, Vane, repeatability
from isiw.devices.robot.vane.rotation import Load, Performance, Supply, performance, rotate
from isiw.plots.style import BLUE, FAINT, ORANGE, save_figure, tidied
from isiw.types import FloatArray

SIDE = 20
HEIGHTS_MM, DEPTHS_MM = np.linspace(7.5, 37.5, SIDE), np.linspace(12.5, 150.0, SIDE)
ROW_MM = (7.5, 10.0, 12.5, 15.0, 17.5, 20.0, 22.5, 25.0, 30.0, 37.5)
PAIR_MM = (40.0, 125.0)
SEED = 10_000

CHANGES: dict[str, tuple[str, tuple[float, float]]] = {
    "valve_l_s_bar": ("supply", (0.5, 2.0)),
    "fitting_l_s_bar": ("supply", (0.375, 1.5)),
    "critical_ratio": ("supply", (0.1, 0.4)),
    "bore_mm": ("supply", (4.0, 8.0)),
    "dead_ml": ("rotor", (0.5, 10.0)),
    "leak_l_min": ("rotor", (0.0, 5.0)),
    "line_m": ("supply", (3.75, 15.0)),
    "reservoir_bar": ("supply", (3.0, 5.0)),
    "friction_nm": ("rotor", (1.35, 5.4)),
    "damping_nm_s": ("rotor", (0.15, 0.6)),
    "payload_n": ("load", (1.0, 10.0)),
}
"""What is changed, one at a time, and to what; the first six are what the text does not state or states loosely."""


def filled_bar(t_ms: FloatArray, volume_m3: float, supply: Supply) -> FloatArray:
    """Pressure of a fixed volume that fills from the room's pressure through the valve alone, in closed form [bar].

    Choked, it rises in proportion to time; from the critical ratio on, the flow falls along an ellipse, so that the
    pressure follows a sine.
    """
    ratio, high = supply.critical_ratio, supply.reservoir_bar
    per_ms = supply.valve_l_s_bar * high / (1e6 * volume_m3)
    first_ms = max(0.0, (ratio * high - 1.0) / per_ms)
    first = math.asin(max(0.0, (1.0 / high - ratio) / (1 - ratio)))  # where the flow is never choked
    phase = np.minimum(first + per_ms / high * (t_ms - first_ms) / (1 - ratio), np.pi / 2)
    return np.where(t_ms < first_ms, 1.0 + per_ms * t_ms, high * (ratio + (1 - ratio) * np.sin(phase)))


def row(depth_mm: float = 150.0, vane: Vane | None = None) -> list[Vane]:
    """Actuators of one depth."""
    vane = vane or Vane()
    return [replace(vane, rotor=replace(vane.rotor, height_mm=h, depth_mm=depth_mm)) for h in ROW_MM]


def plane() -> tuple[Performance, float]:
    """The whole plane, heights first, and the processor time that it took [s]."""
    began_s = time.process_time()
    found = performance([Vane(Rotor(float(h), float(d))) for h in HEIGHTS_MM for d in DEPTHS_MM])
    return found, time.process_time() - began_s


def of_sizes(found: Performance) -> tuple[FloatArray, FloatArray]:
    """Range and delay by height and depth."""
    return found.range_share.reshape(SIDE, SIDE), found.delay_ms.reshape(SIDE, SIDE)


def at_depth() -> pd.DataFrame:
    """The row of 150 mm, with periods of 1 s and of 2 s, and with the lightest and the heaviest load."""
    loads = (Load(), Load(payload_n=1.0), Load(payload_n=10.0))
    found = performance([vane for load in loads for vane in row(vane=Vane(load=load))])
    one, light, heavy = found.range_share.reshape(len(loads), -1)
    usual_ms, light_ms, heavy_ms = found.delay_ms.reshape(len(loads), -1)
    return pd.DataFrame(
        {
            "h [mm]": ROW_MM,
            "range, period 1 s": one,
            "range, period 2 s": performance(row(), period_s=2.0, periods=5).range_share,
            "range, 1 N": light,
            "range, 10 N": heavy,
            "delay [ms]": usual_ms,
            "delay, 1 N": light_ms,
            "delay, 10 N": heavy_ms,
            "break-away [bar]": [vane.rotor.break_away_bar for vane in row()],
        }
    )


def influences() -> pd.DataFrame:
    """One parameter changed at a time: delays, and which heights reach the full range, at a depth of 150 mm."""
    cases: list[tuple[str, float | None, Vane]] = [("as chosen", None, Vane())]
    cases.append(("SMC SY3000", None, replace(Vane(), supply=Supply(valve_l_s_bar=1.1, critical_ratio=0.28))))
    for name, (part, values) in CHANGES.items():
        for value in values:
            changed = replace(getattr(Vane(), part), **{name: value})
            cases.append((name, value, replace(Vane(), **{part: changed})))
    found = performance([each for *_, vane in cases for each in row(vane=vane)])
    delays, ranges = (values.reshape(len(cases), -1) for values in (found.delay_ms, found.range_share))
    lines = [
        {
            "parameter": name,
            "value": value,
            "delay, h 10 [ms]": delay[1],
            "delay, h 17.5 [ms]": delay[4],
            "full range at h [mm]": _span(share >= FULL),
            "range, h 37.5": share[-1],
        }
        for (name, value, _), delay, share in zip(cases, delays, ranges, strict=True)
    ]
    return pd.DataFrame(lines)


def _span(full: np.ndarray) -> str:
    heights = np.array(ROW_MM)[full]
    ends = dict.fromkeys(f"{height:g}" for height in heights[[0, -1]]) if heights.size else ["none"]
    return "–".join(ends)


def courses() -> pd.DataFrame:
    """Fig. 7.11 for several heights, of which the text does not give its own: speed, range, pressure difference."""
    sizes = [(height_mm, depth_mm) for height_mm in (15.0, 20.0, 30.0, 35.0, 37.5) for depth_mm in PAIR_MM]
    done = rotate([Vane(Rotor(*size)) for size in sizes], duration_s=10.0)
    settled = done.t_ms >= 9000  # the last period
    shares = done.angle_rad[:, settled] / np.pi
    difference = 100 * (done.chamber_bar[:, 0] - done.chamber_bar[:, 1])[:, settled]
    return pd.DataFrame(
        {
            "h [mm]": [height_mm for height_mm, _ in sizes],
            "d [mm]": [depth_mm for _, depth_mm in sizes],
            "range": np.ptp(shares, axis=1),
            "speed [1/s]": [_speed_per_s(share) for share in shares],
            "highest [kPa]": difference.max(axis=1),
            "lowest [kPa]": difference.min(axis=1),
        }
    )


def _speed_per_s(share: FloatArray) -> float:
    """Mean speed over the middle 60 % of a stroke, sampled each millisecond."""
    low, high = share.min(), share.max()
    inside = (share > low + 0.2 * (high - low)) & (share < high - 0.2 * (high - low))
    return float(np.abs(np.diff(share))[inside[1:]].mean() * 1000)


def accuracy() -> dict[str, float]:
    """The largest relative errors of the solver [%]: against the closed form, and against itself at half the step."""
    supply = Supply(line_m=0.01, bore_mm=100, fitting_l_s_bar=1e-9, critical_ratio=0.35)  # choked first, then not
    held = Vane(Rotor(15, 150, friction_nm=1000, leak_l_min=0), supply=supply)
    done = rotate([held], duration_s=0.2, half_wave_s=1.0)
    filled = filled_bar(done.t_ms, supply.line_m3, supply)
    small = [Vane(Rotor(h, d)) for h in HEIGHTS_MM[::4] for d in DEPTHS_MM[3::4]]
    one, half = (performance(small, periods=2, step_ms=step_ms) for step_ms in (0.1, 0.05))
    return {
        "filling of a fixed volume": float(100 * np.abs(done.line_bar[0, 0] / filled - 1).max()),
        "delay at half the step": float(100 * np.nanmax(np.abs(one.delay_ms / half.delay_ms - 1))),
        "range at half the step": float(100 * np.abs(one.range_share - half.range_share).max()),
    }


def draw(shares: FloatArray, delays: FloatArray, line: pd.DataFrame) -> Figure:
    """Fig. 7.9 and 7.10."""
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    panels = figure.subplots(2, 2)
    tidied(*panels.flat)
    for panel, values, levels, title in (
        (panels[0, 0], shares, np.linspace(0, 1, 11), "range within a period of 1 s, share of 180°"),
        (panels[0, 1], delays, np.arange(60, 201, 10), "break-away delay [ms]"),
    ):
        contours = panel.contourf(DEPTHS_MM, HEIGHTS_MM, values, levels=levels, extend="max", cmap="cividis")
        figure.colorbar(contours, ax=panel)
        panel.set(xlabel="depth d [mm]", ylabel="height h [mm]", title=title)
    panels[0, 0].contour(DEPTHS_MM, HEIGHTS_MM, shares, levels=[FULL], colors="white")
    for panel, name, text_span in (
        (panels[1, 0], "range, period 1 s", None),
        (panels[1, 1], "delay [ms]", (80, 100)),
    ):
        panel.axvspan(10, 17.5, color=FAINT, alpha=0.2, label="heights that the text recommends")
        if text_span:
            panel.axhspan(*text_span, color=ORANGE, alpha=0.2, label="delay that the text has for them")
        panel.plot(line["h [mm]"], line[name], "o-", color=BLUE, label="here, d = 150 mm")
        panel.set(xlabel="height h [mm]", ylabel=name)
        panel.legend(fontsize=8, frameon=False)
    return figure


def main(out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("vane")) -> None:
    """Compare the simulated actuator with chapter 7."""
    found, sweep_s = plane()
    shares, delays = of_sizes(found)
    study = repeatability.study_vane(rotations=500, seed=SEED)
    tables = {
        "At a depth of 150 mm (Fig. 7.10)": at_depth(),
        "Two depths (Fig. 7.11)": courses(),
        "What decides, at a depth of 150 mm": influences(),
        "Errors of the solver [%]": pd.DataFrame([accuracy()]),
        "Strokes over the full range [ms after 500 ms at rest]": study.event_table.reset_index(),
    }
    facts = facts_of("vane", "numpy", "scipy", "pandas", seed=SEED) | {"seconds for 20 x 20": round(sweep_s, 1)}
    names = ("row", "courses", "influences", "accuracy", "strokes")
    claims = claims_of(HEIGHTS_MM, DEPTHS_MM, shares, delays, dict(zip(names, tables.values(), strict=True)))
    surfaces = {"heights_mm": HEIGHTS_MM, "depths_mm": DEPTHS_MM, "range_share": shares, "delay_ms": delays}
    of_plane = {name: json.loads(pd.DataFrame(values).to_json(orient="values")) for name, values in surfaces.items()}
    write_tables(tables, facts, out, floatfmt=".4g", claims=claims, **{"The plane": of_plane})
    save_figure(
        draw(shares, delays, tables["At a depth of 150 mm (Fig. 7.10)"]), out.with_suffix(".png"), overwrite=True
    )
    print(out.with_suffix(".md").read_text("utf-8"))


if __name__ == "__main__":
    understood("vane")
    typer.run(main)
