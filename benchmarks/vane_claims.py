"""What chapter 7 of the dissertation says of the vane actuator, beside what the simulated one does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from benchmarks.dissertation.claims import Claim, claims_as_json
from isiw import Rotor, Vane
from isiw.types import BoolArray, FloatArray

FULL = 0.9999
"""A range that counts as full, as a share of 180°."""

_AIR = Vane().supply
CHOSEN = (
    f"C_0 = {_AIR.valve_l_s_bar:g}, C_f = {_AIR.fitting_l_s_bar:g} l/(s bar), "
    f"C_r = {_AIR.critical_ratio:g}, a bore of {_AIR.bore_mm:g} mm, and a wave of 1 s there and back"
)
READING = f"under reading {CHOSEN}"
FITTED = f"under reading fitted: {CHOSEN}"
TAKEN_OVER = "under reading taken over, not a result"
RECOMMENDED_MM = (10.0, 12.5, 15.0, 17.5)


def claims_of(
    heights_mm: FloatArray,
    depths_mm: FloatArray,
    shares: FloatArray,
    delays: FloatArray,
    tables: Mapping[str, pd.DataFrame],
) -> list[dict[str, str]]:
    """Every table and figure of the chapter, and what its text concludes.

    Args:
        heights_mm: of the plane [mm].
        depths_mm: of the plane [mm].
        shares: range by height and depth, as a share of 180°.
        delays: break-away delay by height and depth [ms], NaN without motion.
        tables: `row`, `courses`, `influences` and `strokes`, as the benchmark makes them.
    """
    claims = (
        *_of_the_model(),
        *_of_the_plane(heights_mm, depths_mm, shares, delays),
        *_of_the_row(tables["row"]),
        *_of_the_courses(tables["courses"]),
        *_of_the_text(tables["influences"], tables["strokes"]),
    )
    return claims_as_json(claims)


def _verdict(holds: object, otherwise: str, reading: str = READING) -> str:
    """Whether a claim holds under a reading."""
    return reading if holds else f"not, because {otherwise}"


def _of_the_model() -> Iterator[Claim]:
    drawn = "not, because a simulation has nothing to set beside a drawing or photograph"
    for where, shown in (
        ("Fig. 7.1", "rotor with its dimensions"),
        ("Fig. 7.2", "printed actuator"),
        ("Fig. 7.3", "first prototype from an angle"),
        ("Fig. 7.4", "first prototype from the side"),
        ("Fig. 7.5", "first prototype with the tapping device"),
    ):
        yield Claim(where, f"The figure shows the {shown}.", "a picture", "none", "none", drawn)
    yield Claim(
        "Fig. 7.6",
        "Compressed air in one chamber turns the shaft while the other chamber is open to the room.",
        "principle",
        "the same",
        "none",
        TAKEN_OVER,
    )
    yield Claim(
        "Fig. 7.7",
        "A reservoir, a line with a delay of L/c, and a chamber are joined by a valve and a fitting.",
        "L/c not evaluated",
        f"{Vane().supply.delay_ms:.1f} ms; one line for each chamber",
        "(7.2) has its inequality turned round, (7.7) gets R T",
        TAKEN_OVER,
    )
    found_bar = Rotor(20, 150).break_away_bar
    yield Claim(
        "Fig. 7.8, (7.8)",
        "The air turns the shaft by its pressure difference times A (h/2 + r).",
        "prints d/2 for h/2",
        f"h/2, the lever by which the work is that of the air; with it 2.7 N m are {found_bar:.3f} bar at 20 × 150 mm",
        "0.4 bar is what the text derives 2.7 N m from",
        "under reading h/2 for d/2",
    )
    yield Claim(
        "Table 7.1",
        "Friction, damping, inertia, weights and lengths of rotor and load.",
        "15 values",
        "the same; the load is 5 N where no other is said",
        "C_0, C_f, C_r, the bore and the dead volume are not in the table",
        TAKEN_OVER,
    )


def _of_the_plane(
    heights_mm: FloatArray, depths_mm: FloatArray, shares: FloatArray, delays: FloatArray
) -> Iterator[Claim]:
    full = shares >= FULL
    yield Claim(
        "Fig. 7.9a",
        "The full range within 1 s is reached on part of the plane, and size does not help throughout.",
        "part of the plane; not monotone",
        f"{full.mean():.0%} of the plane; the range falls with height in {_falling(shares)} of the steps",
        "the contours of the text cannot be read",
        _verdict(0 < full.mean() < 1 and (np.diff(shares, axis=0) < 0).any(), "it is monotone here"),
    )
    yield Claim(
        "Fig. 7.9b",
        "The break-away delay falls almost monotonically with the size.",
        "almost monotone but for very small rotors",
        f"falls in {_falling(delays)} of the steps with height and in {_falling(delays.T)} of those with depth",
        f"{np.isnan(delays).mean():.0%} of the plane is too small to move at all",
        _verdict(_share_falling(delays) > 0.95 and _share_falling(delays.T) > 0.95, "it also rises"),
    )
    swept_ml = np.array([[np.pi * 1e6 * Rotor(h, d).lever_m3 for d in depths_mm] for h in heights_mm])
    low, high = swept_ml[full].min(), swept_ml[full].max()
    within = full[(swept_ml >= low) & (swept_ml <= high)].mean()
    yield Claim(
        "7.5, Fig. 7.9",
        "The best sizes are those of one range of actuator volume, whatever the shape.",
        "a unique range of volume, not given",
        f"{low:.0f}–{high:.0f} ml swept; {within:.0%} of the sizes with such a volume reach the full range",
        "not stated",
        _verdict(within > 0.75, "the volume alone does not decide: height and depth do not stand for each other"),
    )


def _falling(values: FloatArray) -> str:
    return f"{_share_falling(values):.0%}"


def _share_falling(values: FloatArray) -> float:
    """Among neighbours along the first axis that are known."""
    steps = np.diff(values, axis=0)
    known: BoolArray = ~np.isnan(steps)
    return float((steps[known] < 0).mean())


def _of_the_row(row: pd.DataFrame) -> Iterator[Claim]:
    heights = row["h [mm]"]
    full = heights[row["range, period 1 s"] >= FULL]
    at_ends = row["range, period 1 s"].iloc[[0, -1]]
    yield Claim(
        "Fig. 7.10a",
        "At a depth of 150 mm the full range is reached at heights of 10–17.5 mm.",
        "10–17.5 mm; the axis ends at 0.4",
        f"{full.min():g}–{full.max():g} mm; {at_ends.iloc[0]:.2f} at 7.5 mm and {at_ends.iloc[1]:.2f} at 37.5 mm",
        "none",
        _verdict(tuple(full) == RECOMMENDED_MM, "the heights differ", FITTED),
    )
    delays = row["delay [ms]"][heights.isin(RECOMMENDED_MM)]
    low, high = delays.min(), delays.max()
    yield Claim(
        "Fig. 7.10b",
        "The break-away delay there is 80–100 ms, and falls with the height.",
        "80–100 ms",
        f"{low:.0f}–{high:.0f} ms; from {row['delay [ms]'].max():.0f} ms at 7.5 mm to {row['delay [ms]'].min():.0f} ms",
        f"{low - 80:+.1f} ms and {high - 100:+.1f} ms at the two ends",
        _verdict(low >= 79.5 and high <= 100.5, "C_0 and C_f, which are not stated, decide the delay", FITTED),
    )
    loaded = [np.abs(row[f"range, {one}"] - row["range, period 1 s"]).max() for one in ("1 N", "10 N")]
    delayed = [np.abs(row[f"delay, {one}"] - row["delay [ms]"]).max() for one in ("1 N", "10 N")]
    yield Claim(
        "7.5",
        "A payload of 0.1–1 kg does not change what the actuator does.",
        "not sensitive",
        f"the range changes by at most {max(loaded):.3f} of 180°, the delay by {max(delayed):.1f} ms",
        "none",
        _verdict(max(loaded) < 0.02 and max(delayed) < 2, "it does"),
    )


def _of_the_courses(courses: pd.DataFrame) -> Iterator[Claim]:
    small, large = (courses[courses["h [mm]"] == 35.0].iloc[index] for index in (0, 1))
    ours = [2 * float(one["range"]) for one in (small, large)]
    yield Claim(
        "Fig. 7.11a",
        "With one height, a depth of 40 mm turns faster than one of 125 mm.",
        "2 and 1.2 ranges a second",
        f"{ours[0]:.2f} and {ours[1]:.2f} at h = 35 mm, as range in half a period of 0.5 s",
        f"{ours[0] - 2:+.2f} and {ours[1] - 1.2:+.2f}",
        _verdict(
            abs(ours[0] - 2) < 0.1 and abs(ours[1] - 1.2) < 0.12,
            "the height is not stated",
            f"{FITTED}, at h = 35 mm, the speed being the range over half a period",
        ),
    )
    yield Claim(
        "Fig. 7.11b",
        "The smaller chamber builds up its pressure difference faster.",
        "axis from -250 to 200 kPa",
        f"{small['lowest [kPa]']:.0f} to {small['highest [kPa]']:.0f} kPa at 40 mm, "
        f"{large['lowest [kPa]']:.0f} to {large['highest [kPa]']:.0f} kPa at 125 mm",
        "the same in both directions here; that the smaller one is faster holds",
        "not, because the text's outlets differ, by how much is not stated, and its two directions with them",
    )


def _of_the_text(influences: pd.DataFrame, strokes: pd.DataFrame) -> Iterator[Claim]:
    of = {(line["parameter"], line["value"]): line for _, line in influences.iterrows()}
    leak, friction = ([of[name, value] for value in values] for name, values in _LOOSE.items())
    yield Claim(
        "7.5",
        "Leakage changes the initial delay rather than the range.",
        "delay, not range",
        f"{_pair(leak, 'delay, h 10 [ms]')} ms and {_pair(leak, 'range, h 37.5')} of 180° without a leak and with "
        "ten times the text's",
        "neither changes",
        "not, because a leak of this size changes neither",
    )
    yield Claim(
        "7.5",
        "The break-away pressure changes the initial delay rather than the range.",
        "delay, not range",
        f"{_pair(friction, 'delay, h 10 [ms]')} ms and {_pair(friction, 'range, h 37.5')} of 180° with half and twice "
        f"the friction; full range at h {_pair(friction, 'full range at h [mm]')}",
        "large vanes lose little of their range, small ones much",
        "not, because the friction also decides which small sizes reach the full range",
    )
    yield Claim(
        "7.4",
        "The duty cycle is adjusted, since the valve's two outlets differ.",
        "adjusted, by how much is not said",
        "equal outlets and equal halves",
        "a rotation that does not fill the range is not centred",
        "not, because the outlets' conductances are not stated",
    )
    motion, end = (strokes.set_index("event").loc[name] for name in ("motion", "end"))
    yield Claim(
        "7.1, 7.5",
        "A rotation has to begin with a precision of 40–60 ms.",
        "left to an experiment",
        f"SD {motion['sd_ms']:.1f} ms over {motion['n']:.0f} strokes, "
        f"range {motion['high_ms'] - motion['low_ms']:.0f} ms",
        "far below 40 ms",
        "under reading a friction that varies by 10 % and a pressure that varies by 2 %, which nobody has measured",
    )
    yield Claim(
        "8.1.2",
        "The actuator can be combined with the tapping device.",
        "future work",
        f"`RotatingTapper`; from one end to the other {end['mean_ms'] - 500:.0f} ms after its valve opens, "
        f"SD {end['sd_ms']:.1f} ms",
        "simulated only",
        _verdict(end["mean_ms"] - 500 < 1000, "it takes longer than 1 s"),
    )


_LOOSE = {"leak_l_min": (0.0, 5.0), "friction_nm": (1.35, 5.4)}


def _pair(lines: list[pd.Series], name: str) -> str:
    return " and ".join(value if isinstance(value, str) else f"{value:.3g}" for value in (line[name] for line in lines))
