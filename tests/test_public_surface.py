from __future__ import annotations

import ast
import importlib
import pkgutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

import isiw

ROOT = Path(__file__).parents[1]
STUB = ast.parse(Path(isiw.__path__[0], "__init__.pyi").read_text(encoding="utf-8"))
HOMES = {alias.name: node.module for node in STUB.body if isinstance(node, ast.ImportFrom) for alias in node.names}
"""The module that each public name is listed from; None for a module itself."""


def test_every_public_name_is_what_its_module_calls_so() -> None:
    for name in dir(isiw):
        home = HOMES[name]
        module = importlib.import_module(f"isiw.{home or name}")
        assert getattr(isiw, name) is (getattr(module, name) if home else module), name


def test_what_uses_any_package_can_be_sent_to_workers() -> None:
    # A package with a function of its module's name gets a class of lazy_loader's, which cannot be pickled.
    packages = [name for _, name, has_modules in pkgutil.walk_packages(isiw.__path__, "isiw.") if has_modules]
    assert "isiw.priors" in packages
    assert [name for name in packages if type(importlib.import_module(name)) is not ModuleType] == []


def test_the_version_is_that_of_the_package_and_of_the_citation() -> None:
    package = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert isiw.__version__ == package["project"]["version"]
    assert f"\nversion: {isiw.__version__}\n" in citation


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="windwo"):
        getattr(isiw, "windwo")  # noqa: B009 - mypy knows that there is none


def test_the_surface_that_lab_software_relies_on_is_pinned() -> None:
    assert {
        "CallbackDevice", "DesignSpace", "Device", "DeviceInfo", "Limits", "Measurement", "Session", "Stimulus",
        "StopDecision", "Sweep", "Trial", "TrialTable", "VirtualClock", "Window", "WindowEstimate", "errors",
        "exclude", "list_strategies", "make_strategy", "metrics", "read_session", "resume", "signals", "subjects",
        "testing",
    } <= set(dir(isiw))  # fmt: skip


def test_importing_isiw_loads_nothing_heavy() -> None:
    heavy = "{'torch', 'numpy', 'pandas', 'matplotlib', 'scipy', 'pydantic'}"
    subprocess.run([sys.executable, "-c", f"import sys, isiw; assert not {heavy} & set(sys.modules)"], check=True)  # noqa: S603
