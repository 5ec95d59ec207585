"""The build of the engine: what it asks for, when it compiles, and what wheels it refuses."""

from __future__ import annotations

import ctypes
import shutil
import zipfile
from pathlib import Path

import hatch_build
import pytest
import wheels

from isiw.errors import IsiwError
from isiw.native.engine import require_built_of

LIBRARY = hatch_build.NATIVE / hatch_build.here().file
LINUX = hatch_build.TARGETS["linux-x86_64"]


@pytest.fixture
def nothing_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A computer without any compiler, and without a library of isiw."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("ISIW_TARGET", raising=False)
    monkeypatch.setattr(hatch_build, "zig", lambda: None)
    return tmp_path / "_engine.so.1"


def sources(folder: Path) -> Path:
    return Path(shutil.copytree(hatch_build.SOURCES, folder / "source"))


def test_a_library_is_taken_beside_the_sources_that_it_was_made_of(tmp_path: Path) -> None:
    require_built_of(ctypes.CDLL(str(LIBRARY)), sources(tmp_path))


def test_a_library_is_taken_where_there_are_no_sources_as_in_an_installed_package(tmp_path: Path) -> None:
    require_built_of(ctypes.CDLL(str(LIBRARY)), tmp_path / "source")


@pytest.mark.parametrize("change", ["a byte", "a name", "another file"])
def test_a_library_of_other_sources_is_refused_and_the_remedy_is_to_install_again(tmp_path: Path, change: str) -> None:
    folder = sources(tmp_path)
    if change == "a byte":
        (folder / "level.c").write_text((folder / "level.c").read_text("utf-8") + "\n", "utf-8")
    elif change == "a name":
        (folder / "level.c").rename(folder / "levels.c")
    else:
        (folder / "new.h").touch()
    with pytest.raises(IsiwError, match=r"made of other sources .* Run pip install -e \. again"):
        require_built_of(ctypes.CDLL(str(LIBRARY)), folder)


def test_unchanged_sources_are_not_compiled_again(nothing_here: Path) -> None:
    nothing_here.write_bytes(b"..." + hatch_build.stamp().encode() + b"\0...")
    hatch_build.build(nothing_here)  # nothing here could compile them


@pytest.mark.parametrize("name", ["ISIW_SANITIZE", "ISIW_CFLAGS"])
def test_other_flags_compile_again(nothing_here: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    nothing_here.write_bytes(hatch_build.stamp().encode())
    monkeypatch.setenv(name, "1")
    assert not hatch_build.is_current(nothing_here)


def test_without_any_compiler_one_sentence_says_what_to_install(nothing_here: Path) -> None:
    with pytest.raises(SystemExit, match=r"no C compiler was found: .* pip install ziglang$"):
        hatch_build.build(nothing_here)


def test_zig_is_asked_for_only_without_a_compiler(nothing_here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hatch_build, "NATIVE", nothing_here.parent)
    monkeypatch.setattr(hatch_build, "stamp", lambda: "isiw-sources:")
    assert hatch_build.asked_for() == [hatch_build.ZIG]
    monkeypatch.setattr(hatch_build, "installed", lambda: ["cc"])
    assert hatch_build.asked_for() == []
    monkeypatch.setenv("ISIW_TARGET", "macos-arm64")
    assert hatch_build.asked_for() == [hatch_build.ZIG]


def test_a_compiler_that_is_named_and_does_not_work_is_named_in_the_error(
    nothing_here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler -O2")
    with pytest.raises(SystemExit, match=r"cannot compile isiw's engine: no-such-compiler -O2\."):
        hatch_build.build(nothing_here)


def test_an_unknown_target_is_refused_with_those_that_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ISIW_TARGET", "amiga")
    with pytest.raises(SystemExit, match=r"ISIW_TARGET is amiga; expected one of linux-x86_64, .*windows-x86_64\."):
        hatch_build.wanted()


ELF = b"\x7fELF\x02".ljust(18, b"\0") + b"\x3e\0"
GOOD = ELF + b"libc.so.6\0libm.so.6\0GLIBC_2.2.5\0GLIBC_2.17\0"


def stamped(content: bytes) -> bytes:
    return content + hatch_build.stamp().encode()


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (stamped(GOOD), None),
        (GOOD, "other sources"),
        (stamped(GOOD + b"GLIBC_2.29\0"), "needs glibc 2.29"),
        (stamped(GOOD + b"libgomp.so.1\0"), "needs libgomp.so.1"),
        (stamped(GOOD + str(hatch_build.ROOT).encode()), "folders of this computer"),
        (stamped(ELF[:18] + b"\xb7\0"), "ELF for processor 183; expected ELF for x86_64"),
        (stamped(b"MZ".ljust(0x3C, b"\0") + b"\x40\0\0\0PE\0\0\x64\x86"), "PE for processor 34404; expected ELF"),
        (b"", "no library"),
    ],
)
def test_a_library_for_linux_is_judged_by_its_format_and_by_what_it_needs(content: bytes, fault: str | None) -> None:
    found = wheels.faults_of_library(content, LINUX)
    assert len(found) == (fault is not None)
    assert fault is None or fault in found[0]


def test_a_wheel_is_refused_for_its_tag_for_sources_and_without_a_library(tmp_path: Path) -> None:
    wheel = tmp_path / f"isiw-0.1.0-py3-none-{LINUX.tag}.whl"
    files = {"isiw-0.1.0.dist-info/WHEEL": f"Root-Is-Purelib: false\nTag: py3-none-{LINUX.tag}\n".encode()}
    assert judged(wheel, files | {"isiw/native/_engine.so.1": stamped(GOOD)}) == []
    assert "expected isiw/native/_engine.so.1 alone" in judged(wheel, files)[0]
    assert judged(wheel, files | {"isiw/native/_engine.so.1": stamped(GOOD), "isiw/native/source/level.c": b""}) == [
        "it holds isiw/native/source/level.c, a source"
    ]
    any_tag = {"isiw-0.1.0.dist-info/WHEEL": b"Root-Is-Purelib: true\nTag: py3-none-any\n"}
    assert judged(wheel, any_tag | {"isiw/native/_engine.so.1": stamped(GOOD)}) == [
        f"it has not the tag py3-none-{LINUX.tag}",
        "it says to be pure Python",
    ]


def judged(wheel: Path, files: dict[str, bytes]) -> list[str]:
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return wheels.faults(wheel, LINUX)
