"""Makes the wheels of isiw for Linux, macOS and Windows on one computer, and checks what is in them.

    python wheels.py FOLDER [TARGET…]

needs `pip install hatchling ziglang`. That a wheel is as it should be does not say that isiw has been run there.
"""

from __future__ import annotations

import os
import re
import runpy
import struct
import sys
import tempfile
import zipfile
from pathlib import Path

import hatch_build
from hatch_build import Target

MACHINES = {
    "ELF": {"x86_64": 62, "aarch64": 183},
    "Mach-O": {"x86_64": 0x01000007, "aarch64": 0x0100000C},
    "PE": {"x86_64": 0x8664},
}
NEEDED = {
    "ELF": (rb"lib[\w+-]+\.so[.\d]*", {b"libc.so.6", b"libm.so.6"}),
    "Mach-O": (rb"/[\w/.]+\.dylib", {b"/usr/lib/libSystem.B.dylib"}),
    "PE": (rb"[\w-]+\.dll", {b"kernel32.dll", b"_engine.dll"}),
}
"""What names of other libraries look like, and those that every computer has."""

UNIVERSAL_C = b"api-ms-win-crt-"
"""How the parts of Windows' own C library begin."""

CODE_SIGNATURE = 0x1D


def make(target: Target, folder: Path) -> Path:
    """Make the wheel for one kind of computer, and check it."""
    from hatchling.builders.wheel import WheelBuilder  # noqa: PLC0415 - the checks alone do without

    os.environ["ISIW_TARGET"] = target.name
    (wheel,) = WheelBuilder(str(hatch_build.ROOT)).build(directory=str(folder), versions=["standard"])
    if found := faults(Path(wheel), target):
        Path(wheel).unlink()
        raise SystemExit(f"{wheel}: {'; '.join(found)}")
    return Path(wheel)


def faults(wheel: Path, target: Target) -> list[str]:
    """What is wrong with a wheel: its tag, its files, and its library."""
    tag = f"py3-none-{target.tag}"
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (facts,) = (archive.read(name).decode() for name in names if name.endswith(".dist-info/WHEEL"))
        libraries = [name for name in names if name.rpartition("/")[2].startswith("_engine")]
        found = [] if wheel.stem.endswith(tag) and f"\nTag: {tag}\n" in facts else [f"it has not the tag {tag}"]
        found += ["it says to be pure Python"] if "Root-Is-Purelib: true" in facts else []
        found += [f"it holds {name}, a source" for name in names if name.endswith((".c", ".h"))]
        if libraries != [f"isiw/native/{target.file}"]:
            return [*found, f"its libraries are {libraries}; expected isiw/native/{target.file} alone"]
        return found + faults_of_library(archive.read(libraries[0]), target)


def faults_of_library(content: bytes, target: Target) -> list[str]:
    """What is wrong with a library: its format, its processor, what it needs, and what it was made of."""
    form, machine = header(content)
    expected = "Mach-O" if target.macos else "PE" if target.windows else "ELF"
    if form != expected or machine != MACHINES[form][target.machine]:
        return [f"its library is {form} for processor {machine}; expected {expected} for {target.machine}"]
    pattern, usual = NEEDED[form]
    flags = re.IGNORECASE if form == "PE" else re.NOFLAG
    names = {name.lower() if form == "PE" else name for name in re.findall(pattern, content, flags)}
    other = sorted(name.decode() for name in names - usual if not name.startswith(UNIVERSAL_C))
    found = [f"its library needs {', '.join(other)}"] if other else []
    newest = max(((int(a), int(b)) for a, b in re.findall(rb"GLIBC_(\d+)\.(\d+)", content)), default=(0, 0))
    if newest > hatch_build.OLDEST_GLIBC:
        found.append(f"its library needs glibc {newest[0]}.{newest[1]}")
    if form == "Mach-O" and target.machine == "aarch64" and CODE_SIGNATURE not in commands(content):
        found.append("its library is not signed, and macOS does not load it")
    digest = runpy.run_path(str(hatch_build.NATIVE / "sources.py"))["digest"](hatch_build.SOURCES)
    if f"isiw-sources:{digest}:".encode() not in content:
        found.append("its library was made of other sources")
    if str(hatch_build.ROOT).encode() in content:
        found.append("its library names folders of this computer")
    return found


def header(content: bytes) -> tuple[str, int]:
    """A library's format, and the number of its processor there."""
    if content[:5] == b"\x7fELF\x02":
        return "ELF", int.from_bytes(content[18:20], "little")
    if content[:4] == b"\xcf\xfa\xed\xfe":
        return "Mach-O", int.from_bytes(content[4:8], "little")
    start = int.from_bytes(content[0x3C:0x40], "little")
    if content[:2] == b"MZ" and content[start : start + 4] == b"PE\0\0":
        return "PE", int.from_bytes(content[start + 4 : start + 6], "little")
    return "no library", 0


def commands(content: bytes) -> list[int]:
    """The kinds of the load commands of a Mach-O file."""
    (count,), at, found = struct.unpack_from("<I", content, 16), 32, []
    for _ in range(count):
        kind, size = struct.unpack_from("<II", content, at)
        found.append(kind)
        at += size
    return found


def main(folder: str, *names: str) -> None:
    """Make the wheels of some kinds of computers, or of all."""
    with tempfile.TemporaryDirectory() as cache:
        os.environ.setdefault("ZIG_GLOBAL_CACHE_DIR", cache)
        for name in names or hatch_build.TARGETS:
            sys.stdout.write(f"{make(hatch_build.TARGETS[name], Path(folder))}\n")


if __name__ == "__main__":
    main(*sys.argv[1:] or ["dist"])
