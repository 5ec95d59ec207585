"""The exception tree: what each error is, and what its message says."""

from __future__ import annotations

import pytest

from isiw import errors
from isiw.errors import IsiwError, did_you_mean


def test_a_message_says_what_was_got_what_was_expected_and_the_way_out() -> None:
    error = IsiwError("the MEP is negative", got=-0.1, expected="0 or more", remedy="Check the unit.")
    assert str(error) == "the MEP is negative; got -0.1; expected 0 or more. Check the unit."


def test_a_message_leaves_out_what_is_not_known() -> None:
    assert str(IsiwError("the device is off")) == "the device is off"


def test_a_falsy_value_is_still_reported() -> None:
    assert "got 0" in str(IsiwError("max_trials must be at least 1", got=0))


def test_the_parts_of_a_message_can_be_read_one_by_one() -> None:
    error = IsiwError("a", got=1, expected="b", remedy="c")
    assert (error.what, error.got, error.expected, error.remedy) == ("a", 1, "b", "c")


class Unprintable:
    def __repr__(self) -> str:
        raise RuntimeError


@pytest.mark.parametrize("got", ["x" * 10**6, list(range(10**5)), 16**5000, Unprintable()], ids=type)
def test_a_value_that_is_long_or_cannot_be_printed_is_shortened(got: object) -> None:
    error = IsiwError("what", got=got, remedy="Do this.")
    assert len(str(error)) < 230
    assert str(error).endswith("Do this.")
    assert error.got is got


def test_of_a_long_path_the_files_name_is_still_told() -> None:
    assert "P07.mcap" in str(IsiwError("no log", got="/far" * 100 + "/P07.mcap"))


@pytest.mark.parametrize(
    ("child", "parent"),
    [
        ("OutOfSpaceError", "InvalidValueError"),
        ("LimitExceededError", "DeviceError"),
        ("DeviceTimeoutError", "DeviceError"),
        ("DamagedLogError", "LogError"),
    ],
)
def test_a_narrow_error_is_caught_as_the_wider_one(child: str, parent: str) -> None:
    assert issubclass(getattr(errors, child), getattr(errors, parent))


def test_every_error_of_the_module_has_the_one_root() -> None:
    classes = [value for value in vars(errors).values() if isinstance(value, type) and issubclass(value, Exception)]
    classes = [cls for cls in classes if not issubclass(cls, Warning)]
    assert len(classes) >= 10
    assert all(issubclass(cls, IsiwError) for cls in classes)


@pytest.mark.parametrize("name", ["InvalidValueError", "OutOfSpaceError", "ConfigError"])
def test_bad_values_are_also_value_errors(name: str) -> None:
    assert issubclass(getattr(errors, name), ValueError)


@pytest.mark.parametrize(
    ("given", "meant"), [("impct", "impact"), ("VALVE", "valve"), ("coil", ""), (3, ""), (["valve"], "")]
)
def test_the_known_word_that_was_probably_meant_is_asked_for(given: object, meant: str) -> None:
    assert did_you_mean(given, ["impact", "valve"]) == (f"Did you mean {meant}?" if meant else "")
