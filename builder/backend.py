"""Build backend: setuptools, after the libraries of the compiled law and of the block demo.

If no C compiler of this machine works, the build requires the package `ziglang`, which contains
one. A wheel with libraries fits every Python of its platform; a wheel without them fits every
platform.
"""

import importlib
import os
import shutil
import sys
import sysconfig
from pathlib import Path
from types import ModuleType
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403

ROOT = Path(__file__).parents[1]
TARGET = "JOINTLAW_TARGET"  # environment variable: build a wheel for one of build.TARGETS


# Import the builders without the __init__.py of their packages, which need numpy
for name in ("jointlaw", "dem_demo"):
    package = sys.modules[name] = ModuleType(name)
    package.__path__ = [str(ROOT / name)]
build = importlib.import_module("jointlaw.native.build")
demo_build = importlib.import_module("dem_demo.native.build")


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """Requirements of setuptools, and a compiler if this machine has none."""
    requirements = build_meta.get_requires_for_build_wheel(config_settings)
    builds_for_itself = not os.environ.get(TARGET)
    if builds_for_itself and any(map(build.works, build.compilers_on_path())):
        return requirements
    return [*requirements, "ziglang"]


get_requires_for_build_editable = get_requires_for_build_wheel


def _build_libraries() -> bool:
    """Build the libraries of the law and of the block demo beside their sources.

    Returns whether a compiler was found.
    """
    for folder in (build.BUILT, demo_build.BUILT):
        shutil.rmtree(folder, ignore_errors=True)
    build.write_headers()
    target = os.environ.get(TARGET)
    compiler = build.zig(target) if target else build.find_compiler()
    if compiler is None:
        print("no C compiler works here: the law will run in numpy", file=sys.stderr)
        return False
    for builder in (build, demo_build):
        print(builder.build(compiler), "by", *compiler.command, file=sys.stderr)
    return True


def build_wheel(
    wheel_directory: str, config_settings: Any = None, metadata_directory: str | None = None
) -> str:
    """Build a wheel py3-none-PLATFORM."""
    # setuptools would include files of an earlier build
    shutil.rmtree(ROOT / "build", ignore_errors=True)
    settings = dict(config_settings or {})
    if _build_libraries():
        target = os.environ.get(TARGET)
        platform = build.TARGETS[target] if target else sysconfig.get_platform()
        tags = ["--python-tag", "py3", "--plat-name", platform.replace("-", "_").replace(".", "_")]
        settings["--build-option"] = tags
    return build_meta.build_wheel(wheel_directory, settings, metadata_directory)


def build_editable(
    wheel_directory: str, config_settings: Any = None, metadata_directory: str | None = None
) -> str:
    """Build an editable install, with the libraries in the folders of their sources."""
    _build_libraries()
    return build_meta.build_editable(wheel_directory, config_settings, metadata_directory)
