"""Compiles the engine, the C sources in `src/isiw/native/source`, when a wheel or an editable install is built.

    python hatch_build.py    compiles it in this folder, as pip install -e . does

The compiler is the one that the environment variable CC names, or else cc, gcc or clang. Where none of them works it is
zig, from the package `ziglang`, which the build asks for only then. `ISIW_SANITIZE=1` compiles with checks of addresses
and of undefined behaviour, `ISIW_CFLAGS` has more flags, and `ISIW_TARGET` names another computer to compile for, which
zig does: `wheels.py` makes the wheels of all.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import runpy
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

ROOT = Path(__file__).resolve().parent
NATIVE = ROOT / "src" / "isiw" / "native"
SOURCES = NATIVE / "source"

ZIG = "ziglang>=0.17"
"""What the build asks for where it finds no compiler."""

FLAGS = shlex.split(
    # What may be done to numbers: a product and a sum become one step, and nobody looks at errno or at the traps of the
    # processor. Sums are not reordered: p a + (1 - p) b would lose a small a.
    "-O3 -std=c11 -fPIC -fvisibility=hidden -fno-math-errno -fno-trapping-math -ffp-contract=fast -Wall -Wextra"
)
SANITIZED = shlex.split(
    "-O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all -DISIW_SANITIZED"
)
LEVELS: dict[str, dict[str, list[str]]] = {
    "x86_64": {
        "v2": ["-march=x86-64-v2"],
        "v3": ["-march=x86-64-v3"],
        "v4": ["-march=x86-64-v4", "-mprefer-vector-width=512"],  # or clang makes two halves of each vector
    },
    "aarch64": {"base": []},
}
"""Levels of the processor that `level.c` is compiled for, with their flags; `dispatch.c` chooses among them."""


class Target(NamedTuple):
    """A kind of computer: its library, and in whose words it is named."""

    name: str
    machine: str
    file: str
    zig: str
    tag: str

    @property
    def macos(self) -> bool:
        """Whether its libraries are those of macOS."""
        return self.file.endswith(".dylib")

    @property
    def windows(self) -> bool:
        """Whether its libraries are those of Windows."""
        return self.file.endswith(".dll")


OLDEST_GLIBC = (2, 17)
# A file that ends in .so would be a module of Python to those who look for some.
TARGETS = {
    target.name: target
    for target in (
        Target("linux-x86_64", "x86_64", "_engine.so.1", "x86_64-linux-gnu.2.17", "manylinux_2_17_x86_64"),
        Target("linux-aarch64", "aarch64", "_engine.so.1", "aarch64-linux-gnu.2.17", "manylinux_2_17_aarch64"),
        Target("macos-x86_64", "x86_64", "_engine.dylib", "x86_64-macos.11.0", "macosx_11_0_x86_64"),
        Target("macos-arm64", "aarch64", "_engine.dylib", "aarch64-macos.11.0", "macosx_11_0_arm64"),
        Target("windows-x86_64", "x86_64", "_engine.dll", "x86_64-windows-gnu", "win_amd64"),
    )
}


def fail(sentence: str) -> NoReturn:
    """End with a sentence, which pip shows as it is."""
    raise SystemExit(sentence)


def here() -> Target:
    """This computer."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    system = {"Darwin": "macos"}.get(platform.system(), platform.system().lower())
    for target in TARGETS.values():
        if target.name.startswith(system) and target.machine == machine and struct.calcsize("P") == 8:
            return target
    fail(
        f"isiw's engine cannot be built for this computer: {platform.system()} on {platform.machine()}, "
        f"{8 * struct.calcsize('P')} bits; expected one of {', '.join(TARGETS)}, with a Python of 64 bits."
    )


def wanted() -> Target:
    """The computer to build for: this one, if nobody names another."""
    name = os.environ.get("ISIW_TARGET")
    if name is None:
        return here()
    return TARGETS[name] if name in TARGETS else fail(f"ISIW_TARGET is {name}; expected one of {', '.join(TARGETS)}.")


def compiler() -> list[str] | None:
    """The C compiler for `wanted()`, as a command; None if there is none here, zig's package included."""
    found = None if "ISIW_TARGET" in os.environ else installed()
    return found or zig()


def installed() -> list[str] | None:
    """The C compiler of this computer; None if there is none that works."""
    named = os.environ.get("CC")
    if named:
        command = shlex.split(named, posix=os.name == "posix")
        if not works(command):
            fail(
                f"The environment variable CC names a compiler that cannot compile isiw's engine: {named}. "
                "Name another one (gcc 11 or clang 12, or newer), or unset CC to have one found."
            )
        return command
    return next((command for command in (["cc"], ["gcc"], ["clang"]) if works(command)), None)


def zig() -> list[str] | None:
    """The compiler zig for `wanted()`, if its package is installed."""
    package = importlib.util.find_spec("ziglang")
    if package is None or package.origin is None:
        return None
    return [str(Path(package.origin).with_name("zig")), "cc", "-target", wanted().zig]


def works(command: list[str]) -> bool:
    """Whether a compiler has the headers, the linker and the flags that the engine needs, by trying it."""
    if shutil.which(command[0]) is None:
        return False
    *_, level = LEVELS[wanted().machine].values()
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "trial.c")
        source.write_text("#include <math.h>\ndouble isiw_trial(double x) { return exp(x); }\n", "utf-8")
        made = compiled(command, source, Path(folder, "trial.o"), level)
        return not (made.returncode or linked(command, [Path(folder, "trial.o")], Path(folder, "trial")).returncode)


def flags(command: Sequence[str]) -> list[str]:
    """Flags for a compiler, without those of a level."""
    chosen = [*FLAGS, *(SANITIZED if sanitized() else []), *shlex.split(os.environ.get("ISIW_CFLAGS", ""))]
    if wanted().macos and not is_zig(command):
        chosen += ["-arch", wanted().tag.rpartition("_11_0_")[2], "-mmacosx-version-min=11.0"]
    return chosen


def compiled(command: list[str], source: Path, made: Path, more: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Compile one source."""
    if is_zig(command):  # which has its own spelling of x86-64-v3
        more = [flag.replace("x86-64-v", "x86_64_v") for flag in more]
    return run([*command, *flags(command), *more, "-c", str(source), "-o", str(made)])


def linked(command: list[str], objects: Sequence[Path], made: Path) -> subprocess.CompletedProcess[str]:
    """Make a library of compiled sources."""
    more = [] if sanitized() or (wanted().macos and not is_zig(command)) else ["-s"]  # Apple's linker knows no -s
    if wanted().macos:
        more.append(f"-Wl,-install_name,{made.name}")  # or it would have the path of this computer
    if wanted().windows and not is_zig(command):
        more.append("-static-libgcc")
    return run([*command, *flags(command), "-shared", *more, *map(str, objects), "-o", str(made), "-lm"])


def run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run a compiler, and keep what it says."""
    return subprocess.run(command, capture_output=True, text=True, check=False, errors="replace")


def is_zig(command: Sequence[str]) -> bool:
    """Whether a compiler is zig."""
    return Path(command[0]).stem == "zig"


def sanitized() -> bool:
    """Whether the library is to check itself."""
    return os.environ.get("ISIW_SANITIZE", "0") not in {"", "0"}


def levels() -> dict[str, list[str]]:
    """The levels to compile, with their flags; with checks of itself one, which nearly every computer has."""
    every = LEVELS[wanted().machine]
    return {"v3": every["v3"]} if sanitized() and "v3" in every else every


def stamp() -> str:
    """What a library states of how it was made: the digest of its sources, and that of everything else."""
    named = [os.environ.get(name) for name in ("CC", "ISIW_CFLAGS")]
    made_by = repr([wanted(), LEVELS, FLAGS, SANITIZED if sanitized() else [], named])
    sources = runpy.run_path(str(NATIVE / "sources.py"))["digest"](SOURCES)
    return f"isiw-sources:{sources}:{hashlib.blake2b(made_by.encode(), digest_size=8).hexdigest()}"


STAMP = """\
#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
extern const char isiw_sources[];
const char isiw_sources[] = "{}";
"""


def asked_for() -> list[str]:
    """What the build needs besides hatchling: zig, if it has to compile and there is no compiler."""
    ready = "ISIW_TARGET" not in os.environ and (is_current(NATIVE / here().file) or installed())
    return [] if ready else [ZIG]


def is_current(library: Path) -> bool:
    """Whether a library was made of these sources, with these flags."""
    return library.is_file() and stamp().encode() in library.read_bytes()


def build(library: Path) -> None:
    """Compile the sources into a library, unless it was made of just these."""
    if is_current(library):
        return
    command = compiler()
    if command is None:
        fail(
            "isiw's engine is compiled when it is installed, and no C compiler was found: neither the environment "
            "variable CC nor cc, gcc (11 or newer) or clang, nor the package ziglang. Install one of them, such as by: "
            "pip install ziglang"
        )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ.setdefault("ZIG_GLOBAL_CACHE_DIR", str(folder / "zig"))  # so that nothing stays behind
        (folder / "stamp.c").write_text(STAMP.format(stamp()), "utf-8")
        known = [f"-DISIW_HAS_{level}" for level in levels()]
        jobs = [(SOURCES / "dispatch.c", "dispatch", known), (folder / "stamp.c", "stamp", [])]
        for level, its_flags in levels().items():
            jobs.append((SOURCES / "level.c", level, [f"-DISIW_LEVEL={level}", *its_flags]))
        with ThreadPoolExecutor() as workers:
            done = workers.map(lambda job: compiled(command, job[0], folder / f"{job[1]}.o", job[2]), jobs)
            for made in done:
                require(made)
        require(linked(command, [folder / f"{job[1]}.o" for job in jobs], folder / library.name))
        put(folder / library.name, library)


def require(made: subprocess.CompletedProcess[str]) -> None:
    """Show a compiler's warnings, and end at its errors."""
    sys.stderr.write(made.stderr)
    if made.returncode:
        fail(f"isiw's engine could not be compiled, as the compiler says above; the command: {shlex.join(made.args)}")


def put(made: Path, library: Path) -> None:
    """Put a library in its place at once, so that nobody loads half of one."""
    new = library.with_name(f"{library.name}.{os.getpid()}")
    try:
        shutil.copyfile(made, new)
        new.replace(library)
    except OSError as error:
        new.unlink(missing_ok=True)
        fail(f"{library} cannot be written: {error.strerror}. End what uses isiw, such as a notebook, and try again.")


def get_build_hook() -> type:
    """The hook of hatchling, which is not installed where this file is run as a script."""
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface  # noqa: PLC0415 - see above

    class Engine(BuildHookInterface[Any]):
        """Puts the library into wheels, or beside the sources of an editable install."""

        folder: tempfile.TemporaryDirectory[str] | None = None

        def dependencies(self) -> list[str]:
            return asked_for()

        def initialize(self, version: str, build_data: dict[str, Any]) -> None:
            target = wanted()
            library = NATIVE / target.file
            if "ISIW_TARGET" in os.environ:
                self.folder = tempfile.TemporaryDirectory()  # until the wheel is made
                library = Path(self.folder.name, target.file)
            build(library)
            build_data["pure_python"] = False
            if version != "editable":
                build_data["force_include"][str(library)] = f"isiw/native/{target.file}"
                # A library that the compiler of this computer made is for this computer: its C library may be too new.
                own = not target.macos and not target.windows and "ISIW_TARGET" not in os.environ
                build_data["tag"] = f"py3-none-{f'linux_{target.machine}' if own else target.tag}"

        def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002 - hatchling's
            if self.folder is not None:
                self.folder.cleanup()

    return Engine


if __name__ == "__main__":
    build(NATIVE / here().file)
