"""Numbers and choices from outside."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter

import isiw
from isiw.checks import (
    Checked,
    Count,
    Flag,
    Number,
    Positive,
    Share,
    amplitude,
    ascending,
    choice,
    deadline,
    number,
    numbers,
    share,
    whole,
)
from isiw.errors import ConfigError, InvalidValueError
from isiw.text.toml_files import checked


class Boastful(float):
    """A float that says that it is smaller than it is."""

    def __le__(self, other: object) -> bool:
        return True

    def __lt__(self, other: object) -> bool:
        return True


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_a_number_of_any_kind_becomes_a_plain_float(value: float) -> None:
    for kind in (float, np.float32, np.float64, Fraction):
        got = number("x", kind(value))
        assert type(got) is float
        assert got == value


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, True, "5", None, 1j, [1.0], np.array([1.0]), 10**400])
def test_what_is_not_a_finite_number_is_refused_by_name(value: object) -> None:
    with pytest.raises(InvalidValueError, match="isi_ms must"):
        number("isi_ms", value)


def test_what_is_compared_is_the_plain_number() -> None:
    with pytest.raises(InvalidValueError, match="of at most 500"):
        number("isi_ms", Boastful(5000.0), most=500)


@pytest.mark.parametrize(
    ("bounds", "inside", "outside", "words"),
    [
        ({"above": 0}, (1e-9, 5), (0, -1), "above 0"),
        ({"least": 0}, (0, 5), (-1e-9,), "of at least 0"),
        ({"below": 1}, (0.9,), (1, 2), "below 1"),
        ({"most": 1}, (1,), (1.1,), "of at most 1"),
        ({"least": 0, "most": 1}, (0, 0.5, 1), (-0.1, 1.1), "from 0 to 1"),
        ({"above": 0, "below": 1}, (0.5,), (0, 1), "above 0 and below 1"),
    ],
)
def test_bounds_are_kept_and_named_in_the_message(
    bounds: Any, inside: tuple[float, ...], outside: tuple[float, ...], words: str
) -> None:
    for value in inside:
        assert number("x", value, **bounds) == value
    for value in outside:
        with pytest.raises(InvalidValueError, match=f"a finite number {words}"):
            number("x", value, **bounds)


def test_a_whole_number_is_an_integer_of_any_kind() -> None:
    assert [whole("n", value, least=1) for value in (3, np.int64(3), np.uint8(3))] == [3, 3, 3]
    assert type(whole("n", np.int64(3))) is int


@pytest.mark.parametrize("value", [3.0, True, "3", None, 0, math.nan])
def test_anything_else_is_not_a_whole_number(value: object) -> None:
    with pytest.raises(InvalidValueError, match=r"n must.* at least 1"):
        whole("n", value, least=1)


def test_infinity_and_none_are_no_deadline() -> None:
    assert [deadline("deadline_s", value) for value in (None, math.inf, 0, 2.5)] == [None, None, 0.0, 2.5]
    for wrong in (-1.0, math.nan, -math.inf, "soon"):
        with pytest.raises(InvalidValueError, match="deadline_s"):
            deadline("deadline_s", wrong)


def test_a_choice_is_one_of_the_known_values() -> None:
    assert choice("the edges", "both", ("both", "either")) == "both"
    for wrong in ("one", None, 1):
        with pytest.raises(InvalidValueError, match=r"the edges.*both or either"):
            choice("the edges", wrong, ("both", "either"))
    with pytest.raises(InvalidValueError, match="peaks"):
        choice("peaks", 1.0, (1, 2))


def test_numbers_ascend() -> None:
    assert ascending("window", [15, 35]) == (15.0, 35.0)
    for wrong in ((35, 15), (15, 15), (15, math.nan), (-1, 5)):
        with pytest.raises(InvalidValueError, match="window must"):
            ascending("window", wrong, least=0)


@pytest.mark.parametrize("value", [110, "110", np.array(110.0), None])
def test_a_single_number_a_text_and_an_array_without_a_dimension_are_no_lists(value: Any) -> None:
    for check in (numbers, ascending):
        with pytest.raises(InvalidValueError, match="delays must be"):
            check("delays", value)
    assert numbers("delays", np.array([110.0, 90.0])) == (110.0, 90.0)


@dataclass(frozen=True)
class Declared(Checked):
    width_ms: Positive = 1.0
    share: Share = 0.5
    trials: Count = 1
    limit: Number | None = None
    most: Annotated[int, whole] | None = None
    kind: Literal["a", "b"] = "a"


def test_fields_become_plain_values() -> None:
    numpys: dict[str, Any] = {"width_ms": np.float32(2), "trials": np.int64(3)}
    checked = Declared(**numpys, limit=1)
    assert (checked.width_ms, checked.trials, checked.limit, checked.most) == (2.0, 3, 1.0, None)
    assert [type(value) for value in (checked.width_ms, checked.trials, checked.limit)] == [float, int, float]


@pytest.mark.parametrize(
    "wrong",
    [{"width_ms": 0}, {"share": 1.5}, {"trials": 0}, {"limit": "x"}, {"width_ms": None}, {"most": 2.5}, {"kind": "c"}],
)
def test_a_wrong_field_is_named_with_its_class(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=rf"Declared\.{next(iter(wrong))}"):
        Declared(**wrong)


@pytest.mark.parametrize("value", [1e4, 2e3, 1000.1, 4e38, 1e308, 10**400, -1.0, math.nan, "0.5", True])
def test_an_amplitude_that_no_amplifier_gives_is_refused(value: Any) -> None:
    with pytest.raises(InvalidValueError, match="mep_mv"):
        amplitude("mep_mv", value)


@pytest.mark.parametrize("value", [0, 0.05, 20, np.float32(5), 1000])
def test_an_amplitude_that_an_amplifier_may_give_is_a_plain_number(value: Any) -> None:
    assert type(amplitude("mep_mv", value)) is float
    assert amplitude("mep_mv", value) == value


def test_arrays_are_no_choices_and_no_deadlines() -> None:
    with pytest.raises(InvalidValueError, match="the cohort is unknown"):
        choice("the cohort", np.array(["a", "b"]), ["a", "b"])
    with pytest.raises(InvalidValueError, match="deadline_s"):
        deadline("deadline_s", np.array([1.0, math.inf]))


@dataclass(frozen=True)
class Switched(Checked):
    on: Flag


@pytest.mark.parametrize("on", [True, False, np.True_, np.False_])
def test_a_flag_is_true_or_false(on: Any) -> None:
    assert Switched(on).on is bool(on)


@pytest.mark.parametrize("on", ["false", "", None, 0, 1, 1.0])
def test_a_word_or_a_number_is_no_flag(on: Any) -> None:
    with pytest.raises(InvalidValueError, match="on must"):
        Switched(on)


@dataclass(frozen=True)
class Read(Checked):
    """What files and requests are read as."""

    share: Annotated[float, partial(number, least=0, below=1)] = 0.5
    most: Count | None = None
    on: Flag = False
    ends_ms: Annotated[tuple[float, ...], ascending] = (1.0, 2.0)


@pytest.mark.parametrize(
    "wrong", [{"share": 1.0}, {"share": math.nan}, {"share": -0.1}, {"most": 0}, {"ends_ms": [2.0, 1.0]}]
)
def test_a_table_is_read_by_the_fields_own_checks_and_the_error_has_their_words_and_the_key(
    wrong: dict[str, Any],
) -> None:
    with pytest.raises(InvalidValueError) as made:
        Read(**wrong)
    with pytest.raises(ConfigError) as read:
        checked(Read, wrong, "a.toml")
    words = made.value.what.removeprefix("Read.")  # nobody who writes a file knows the class
    assert f"a.toml: the value of {min(wrong)} cannot be used: {words}" in str(read.value)


@pytest.mark.parametrize("wrong", [{"share": "0.5"}, {"share": True}, {"most": 2.5}, {"most": "2"}, {"on": "true"}])
def test_no_number_and_no_flag_is_made_of_something_else(wrong: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match=f"the value of {min(wrong)} cannot be used"):
        checked(Read, wrong, "a.toml")


def test_a_table_may_leave_out_state_none_and_have_lists_and_its_schema_has_the_bounds() -> None:
    assert checked(Read, {"most": None, "ends_ms": [1, 3], "share": 0}, "a.toml") == Read(0.0, None, False, (1.0, 3.0))
    schema = TypeAdapter(Read).json_schema()["properties"]
    assert (schema["share"]["minimum"], schema["share"]["exclusiveMaximum"]) == (0, 1)
    assert schema["most"]["anyOf"][0] == {"minimum": 1, "type": "integer"}


def test_dataclasses_are_frozen_but_those_that_collect_what_a_file_has() -> None:
    kind = re.compile(r"^@dataclass(?!\(frozen=True).*\nclass (\w+)", re.MULTILINE)
    sources = sorted(Path(isiw.__path__[0]).rglob("*.py"))
    assert [name for path in sources for name in kind.findall(path.read_text("utf-8"))] == [
        "Records",
        "Salvage",
        "_Rows",
    ]


@pytest.mark.parametrize(
    ("value", "is_in_percent"), [(50, True), (100, True), (101, False), (-1, False), ("50", False)]
)
def test_a_share_that_may_be_in_percent_is_refused_with_that_way_out(value: object, *, is_in_percent: bool) -> None:
    with pytest.raises(InvalidValueError, match="from 0 to 1") as refused:
        share("p", value)
    assert ("Is it in %? Divide by 100." in str(refused.value)) == is_in_percent


@pytest.mark.parametrize(
    "make",
    [
        lambda mv: isiw.DeviceInfo("rig", "impact", detection_limit_mv=mv),
        lambda mv: isiw.make_strategy(detection_limit_mv=mv, particles=10),
        lambda mv: isiw.make_strategy(response_threshold_mv=mv, particles=10),
    ],
)
def test_a_smallest_amplitude_in_microvolts_is_asked_about(make: Any) -> None:
    make(0.05)
    with pytest.raises(isiw.errors.IsiwError, match=r"at most 1 mV.*Is it in µV\? Divide by 1000"):
        make(50.0)


def test_an_amplitude_of_minus_zero_is_zero() -> None:
    assert math.copysign(1.0, amplitude("mep_mv", -0.0)) == 1.0
