from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from isiw.devices.info import DeviceInfo
from isiw.errors import DeviceError
from isiw.session.rig import exclusive
from known import known
from scripted import ScriptedDevice

PLAIN = DeviceInfo("rig", "valve")
PORT = DeviceInfo("rig", "valve", address="port of this test")


def test_one_device_is_driven_once_at_a_time() -> None:
    device = ScriptedDevice()
    with exclusive(device, PLAIN):
        with pytest.raises(DeviceError, match="driven by another session"), exclusive(device, PLAIN):
            pass
        with exclusive(ScriptedDevice(), PLAIN):
            pass
    with exclusive(device, PLAIN):
        pass


def test_a_device_is_free_again_after_an_error() -> None:
    device = ScriptedDevice()
    with pytest.raises(ZeroDivisionError), exclusive(device, PORT):
        raise ZeroDivisionError
    with exclusive(device, PORT):
        pass


def test_two_objects_of_one_address_are_one_device() -> None:
    with (
        exclusive(ScriptedDevice(), PORT),
        pytest.raises(DeviceError, match="port of this test"),
        exclusive(ScriptedDevice(), PORT),
    ):
        pass


def test_a_lock_that_cannot_be_taken_is_told_with_the_way_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("isiw.session.rig.lock_folder", lambda: tmp_path)
    with exclusive(ScriptedDevice(), PORT):
        (left,) = tmp_path.iterdir()
        assert os.name == "nt" or left.stat().st_mode & 0o777 == 0o666  # whoever else uses the computer can take it
    left.unlink(missing_ok=True)
    left.mkdir()
    with pytest.raises(DeviceError, match=r"taken.*delete it once"), exclusive(ScriptedDevice(), PORT):
        pass


HOLDER = """
import sys
from isiw.session.rig import exclusive
from isiw.devices.info import DeviceInfo
with exclusive(object(), DeviceInfo("rig", "valve", address="port of this test")):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.mark.skipif(os.name == "nt", reason="there another account's files are guarded otherwise")
def test_the_lock_of_another_account_is_opened_through_no_link_never_emptied_and_without_making_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("isiw.session.rig.lock_folder", lambda: tmp_path)
    with exclusive(ScriptedDevice(), PORT):
        (left,) = tmp_path.iterdir()
    left.write_text("theirs")
    real = os.open

    def guarded(path: Any, flags: int, *mode: int) -> int:  # as Linux guards files in a folder for all
        if flags & os.O_CREAT and os.path.lexists(path):
            raise PermissionError(13, "Permission denied", path)
        return real(path, flags, *mode)

    with monkeypatch.context() as patched:
        patched.setattr(os, "open", guarded)
        with exclusive(ScriptedDevice(), PORT):
            pass
    assert left.read_text() == "theirs"
    left.rename(tmp_path / "victim")
    left.symlink_to(tmp_path / "victim")
    with pytest.raises(DeviceError, match="cannot be taken"), exclusive(ScriptedDevice(), PORT):
        pass
    assert (tmp_path / "victim").read_text() == "theirs"


def test_an_address_is_driven_by_one_process_whatever_its_folder_for_temporary_files(tmp_path: Path) -> None:
    elsewhere = os.environ | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(tmp_path))
    with subprocess.Popen(  # noqa: S603
        [sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=elsewhere
    ) as holder:
        assert known(holder.stdout).readline() == "held\n"
        with pytest.raises(DeviceError, match="driven by another session"), exclusive(ScriptedDevice(), PORT):
            pass
        holder.kill()  # as a crash would: what it held is free again
        holder.wait()
        with exclusive(ScriptedDevice(), PORT):
            pass
