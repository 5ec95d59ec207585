"""Whether a plan can be kept within the limits: told before anything is delivered, and never at the cost of a limit."""

from __future__ import annotations

from typing import Final

from isiw import schedule
from isiw.devices.allowed import earliest_s
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.errors import InvalidValueError
from isiw.intervention import Arm, Plan
from isiw.schedule import Part, Slot

_ROUNDING_S: Final = 1e-6


def require_possible(plan: Plan, limits: Limits, given_before: int, seed: int) -> None:
    """Raise if limits do not allow a plan: its number of stimuli, its ISIs, or one of its times.

    The stimuli of the visit that were given before count; the session's seed draws the intervals.

    Raises:
        InvalidValueError: more stimuli than the limits allow, a range of ISIs beyond theirs, an interval or a rest that
            they make longer, or a block that would not be over when the next is due.
    """
    tests, blocks = plan.before * len(plan.tests), len(plan.after_min)
    after = plan.after * len(plan.tests)
    needed = given_before + len(schedule.slots(plan))
    if needed > limits.max_pulses:
        before = f"{given_before} given before + " if given_before else ""
        raise InvalidValueError(
            "the plan of the intervention does not fit into the limits",
            got=f"max_pulses = {limits.max_pulses}",
            expected=f"at least {before}{tests} before the pairs + {plan.pairs} pairs + {blocks} × {after} after "
            f"= {needed}",
            remedy=f"Write max_pulses = {needed} under [limits] if your ethics approval allows it, or a smaller plan "
            "under [intervention].",
        )
    if plan.range_ms is not None and not limits.low_ms <= plan.range_ms[0] <= plan.range_ms[1] <= limits.high_ms:
        raise InvalidValueError(
            "the ISIs that the plan may follow the window to are beyond the limits",
            got=plan.range_ms,
            expected=f"within {limits.low_ms:g} to {limits.high_ms:g} ms",
        )
    _require_times(plan, limits, seed)


def require_settable(plan: Plan, limits: Limits, device: DeviceInfo, *, searched_several: bool = False) -> None:
    """Raise if a device cannot give what a plan has: an arm, or intensities, which limits may exclude, too.

    Intensities are excluded as well where the search was one of several, each of which the device set itself.

    Raises:
        InvalidValueError: an arm of taps alone, whichever is drawn, at a device that gives none; several intensities at
            a device that is simulated or sets them itself, where the limits have one, or beyond the highest one.
    """
    if Arm.TAP_ALONE in plan.arms and not device.tap_alone:
        raise InvalidValueError(
            "the plan has an arm of taps alone, and the device does not deliver these",
            got=device.name,
            remedy=f'Leave "{Arm.TAP_ALONE}" out of the arms. Or let the device\'s deliver leave out the pulse where '
            "stimulus.tap_alone is True, and describe it with DeviceInfo(..., tap_alone=True).",
        )
    most = limits.max_intensity_pct_rmt
    if plan.intensities_pct_rmt and most is not None and max(plan.intensities_pct_rmt) > most:
        raise InvalidValueError(
            "an intensity of the plan is beyond the limits",
            got=f"intensities_pct_rmt = {plan.intensities_pct_rmt}",
            expected=f"at most {most:g} % RMT, as max_intensity_pct_rmt says",
            remedy="Leave it out; raise the limit only if your ethics approval allows it.",
        )
    if plan.intensities_pct_rmt and searched_several:
        raise InvalidValueError(
            "the intensities of the plan are set by hand, and this session's device sets that of each pulse",
            got=f"intensities_pct_rmt = {plan.intensities_pct_rmt}",
            remedy="Leave out intensities_pct_rmt of the plan, or those of the strategy.",
        )
    if plan.intensities_pct_rmt and (device.simulated or limits.intensity_pct_mso is not None):
        raise InvalidValueError(
            "the intensities of the plan cannot be set",
            got=f"intensities_pct_rmt = {plan.intensities_pct_rmt}",
            expected="none of its own: "
            + ("the device is simulated" if device.simulated else "the limits, or what the device reports, allow one"),
            remedy="Leave out intensities_pct_rmt, so that all pulses have the intensity of the visit.",
        )


def _require_times(plan: Plan, limits: Limits, seed: int) -> None:
    """Raise if one stimulus of the plan cannot come at its time, even if nobody loses any."""
    times_s: list[float] = []
    last_pair_s = 0.0
    for slot in schedule.slots(plan):
        planned_s = (times_s[-1] if times_s else 0.0) + schedule.slot_interval_s(plan, slot, seed)
        if slot.due_s is not None and slot.first:
            _require_over(slot, planned_s - last_pair_s, plan)
            planned_s = max(planned_s, last_pair_s + slot.due_s)
        allowed_s = earliest_s(limits, times_s, 0.0)
        if times_s and allowed_s > planned_s + _ROUNDING_S:
            raise InvalidValueError(
                "the limits do not allow the times of the plan",
                got=f"stimulus {slot.number} ({slot.name}) {planned_s - times_s[-1]:g} s after the one before",
                expected=f"{allowed_s - times_s[-1]:g} s after it, as the limits' intervals, rests and periods say",
                remedy="Give the plan longer intervals, more rests (block_pairs, rest_s), or fewer stimuli; loosen the "
                "limits only if your ethics approval allows it.",
            )
        times_s.append(max(planned_s, allowed_s))
        if slot.number == plan.last_pair:
            last_pair_s = times_s[-1]


def _require_over(slot: Slot, since_s: float, plan: Plan) -> None:
    """Raise if the block before a later one is not over when that one is due."""
    if slot.part is Part.AFTER and slot.block > 0 and slot.due_s is not None and since_s > slot.due_s:
        raise InvalidValueError(
            f"the block before is not over when the block {slot.name} is due",
            got=f"{since_s / 60:.1f} min after the last pair",
            expected=f"at most {slot.due_s / 60:g} min",
            remedy=f"Give each block fewer pulses than {plan.after}, or shorter intervals (test_iti_s), or let the "
            "blocks be further apart (after_min).",
        )
