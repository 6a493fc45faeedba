"""The package as it is installed: quick to import, typed, one version number, a working command."""

import re
import subprocess
import sys
from importlib import metadata
from importlib.resources import files
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LAZY = (
    "scipy",
    "matplotlib",
    "h5py",
    "MDAnalysis",
    "ase",
    "pandas",
    "tqdm",
    "pyvista",
    "meshio",
    "xarray",
)


def run(*command):
    """Runs a command of this interpreter's in a child, its output as text."""
    return subprocess.run(
        [sys.executable, *command], capture_output=True, text=True, timeout=120, check=False
    )


def test_import_loads_no_heavy_library():
    code = f"import sys, sdpd; print(*[name for name in {LAZY} if name in sys.modules])"
    child = run("-c", code)
    assert child.returncode == 0, child.stderr
    assert child.stdout.split() == []


def test_import_starts_no_thread_and_leaves_the_global_generator_alone():
    code = (
        "import threading, numpy as np; np.random.seed(7); a = np.random.get_state()[1].copy()\n"
        "import sdpd; b = np.random.get_state()[1]; print(threading.active_count(), (a == b).all())"
    )
    child = run("-c", code)
    assert child.stdout.split() == ["1", "True"], child.stderr


def test_public_names_exist_and_are_documented():
    import sdpd

    assert sdpd.__all__, "`sdpd.__all__` names what is public"
    for name in sdpd.__all__:
        assert hasattr(sdpd, name), f"`sdpd.{name}` is announced in __all__ but absent"
        if callable(getattr(sdpd, name)):
            assert getattr(sdpd, name).__doc__, f"`sdpd.{name}` has no docstring"


@pytest.mark.parametrize("name", ["py.typed", "_core.pyi"])
def test_typing_files_are_installed(name):
    assert files("sdpd").joinpath(name).is_file()


def test_core_is_built_for_the_stable_abi():
    from sdpd import _core

    if sys.platform != "win32":
        assert Path(_core.__file__).name.endswith(".abi3.so")


def test_version_is_the_same_everywhere():
    import sdpd

    version = metadata.version("sdpd")
    assert sdpd.__version__ == version
    for name in ("Cargo.toml", "CITATION.cff"):
        text = (ROOT / name).read_text(encoding="utf-8")
        found = re.search(r'^version\s*[=:]\s*"?([^"\s]+)"?\s*$', text, re.MULTILINE)
        assert found is not None, f"{name} states no version"
        assert found[1] == version, f"{name} says {found[1]}, the package {version}"


def test_base_requirements_are_few():
    base = [r for r in metadata.requires("sdpd") if "extra ==" not in r]
    names = {re.match(r"[A-Za-z0-9_-]+", r)[0].lower() for r in base}
    assert names == {"numpy", "scipy", "tqdm", "tomli", "tomli-w"}


@pytest.mark.parametrize(
    "command",
    [
        ["-m", "sdpd", "--help"],
        ["-c", "import sys; from sdpd.cli import main; sys.exit(main(['--help']))"],
        ["-m", "sdpd", "diffusion", "--help"],
    ],
    ids=["module", "entry point", "subcommand"],
)
def test_help_is_printed(command):
    child = run(*command)
    assert child.returncode == 0, child.stderr
    assert "diffusion" in child.stdout
    assert child.stderr == ""


def test_console_script_is_declared():
    scripts = metadata.entry_points(group="console_scripts", name="sdpd")
    assert [script.value for script in scripts] == ["sdpd.cli:main"]


def test_version_is_printed():
    child = run("-m", "sdpd", "--version")
    assert child.returncode == 0, child.stderr
    assert metadata.version("sdpd") in child.stdout


def test_unknown_command_fails_without_a_traceback():
    child = run("-m", "sdpd", "turbulence")
    assert child.returncode == 2
    assert "turbulence" in child.stderr
    assert "Traceback" not in child.stderr
