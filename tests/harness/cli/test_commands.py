"""The list of commands, with and without what a command needs installed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil.cli import main
from hil.cli.command_table import commands

WITHOUT = "import sys; sys.modules.update(dict.fromkeys({lacking!r})); from hil.cli import main; main({arguments!r})"
"""Runs the command line in a process in which some packages cannot be imported."""
EMULATE_HAS_NOT = ("jinja2", "matplotlib", "mcap", "pytest", "rich", "scipy", "scservo_sdk", "tomlkit")


def run(lacking, *arguments):
    program = WITHOUT.format(lacking=lacking, arguments=arguments)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("lacking", [(), EMULATE_HAS_NOT])
def test_help_lists_every_command_whatever_is_installed(lacking):
    listed = run(lacking, "--help")
    assert listed.returncode == 0, listed.stderr
    assert [name for name in commands() if f"\n  {name} " in listed.stdout] == list(commands())


def test_a_misspelt_command_is_answered_with_the_nearest():
    refused = CliRunner().invoke(main, ["validat"])
    assert refused.exit_code == 2
    assert "did you mean `validate`?" in refused.output
    assert "did you mean" not in CliRunner().invoke(main, ["xyz"]).output


@pytest.mark.parametrize(
    ("lacking", "said"),
    [("mujoco", "`aero-hil view` needs the extra `hil`; "), ("viser", "a recording's page needs the extra `view`; ")],
)
def test_a_command_whose_extra_is_not_installed_names_it(lacking, said):
    refused = run((lacking,), "view", __file__)
    assert refused.returncode == 2
    assert refused.stderr.startswith(f"Error: {said}")
    assert refused.stderr.count("\n") == 1


def test_emulating_needs_the_extra_emulate_only():
    helped = run(EMULATE_HAS_NOT, "emulate", "--help")
    assert helped.returncode == 0, helped.stderr
    assert "--link" in helped.stdout


HEAVY = ("jinja2", "matplotlib", "mcap", "mujoco", "numpy", "pandas", "rich", "scipy")
"""What takes a tenth of a second and more to import, alone or together."""


@pytest.mark.parametrize("arguments", [("--help",), ("validate", "--help")])
def test_help_imports_nothing_heavy(arguments):
    shown = run(HEAVY, *arguments)
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.startswith("Usage:")


def test_validating_needs_no_pytest_and_loads_neither_scipy_nor_matplotlib():
    """The latter take a second to be imported, a tenth of a validation."""
    program = (
        "import sys, hil.cli.validation_run\n"
        "assert not {'scipy', 'matplotlib'} & sys.modules.keys()\n"
        "import train.cli.record, train.cli.calibrate\n"
        "assert 'pytest' not in sys.modules\n"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_command_starts_no_second_process_to_look_for_a_drawing_library(tmp_path):
    """One that is killed meanwhile would leave a traceback."""
    watched = (
        "import subprocess, sys\n"
        "class Watched(subprocess.Popen):\n"
        "    def __init__(self, command, *given, **how):\n"
        "        if command[0] == sys.executable: raise SystemExit(f'a second process: {command}')\n"
        "        super().__init__(command, *given, **how)\n"
        "subprocess.Popen = Watched\n"
        "from hil.cli import main\n"
        "main(['validate', '--dry-run'])\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "PYGLFW_LIBRARY"}
    environment["PYTHONPATH"] = str(Path(__file__).parents[3])
    ran = subprocess.run(
        [sys.executable, "-c", watched], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr


def test_ctrl_c_ends_the_program_while_modules_are_imported(tmp_path):
    """trimesh catches everything while it looks for optional libraries; pybind11 makes an ImportError of it."""
    program = (
        "import signal, hil.cli\n"
        "def interrupted(module):\n"
        "    try:\n"
        "        signal.raise_signal(signal.SIGINT)\n"
        "    except BaseException as error:\n"
        "        raise ImportError('initialization failed') from error\n"
        "hil.cli.import_module = interrupted\n"
        "hil.cli.main(['view'])\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )  # fmt: skip
    assert ran.returncode == 130, ran.stderr
    # "Stopping…" comes from a thread, so it may be the last, or not come in time.
    assert set(ran.stderr.splitlines()) - {"Stopping…"} == {"Error: interrupted"}


def test_stopping_is_said_before_a_held_signal_is_delivered(tmp_path):
    program = (
        "import signal, sys, click\n"
        "from aero.safety.interrupts import uninterrupted\n"
        "from hil.cli.exits import run\n"
        "def command():\n"
        "    with uninterrupted():\n"
        "        signal.raise_signal(signal.SIGINT)\n"
        "        sys.stdin.readline()\n"
        "run(lambda: click.command()(command).main([], standalone_mode=False))\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], cwd=tmp_path, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        encoding="utf-8", env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3]), "PYTHONUTF8": "1"},
    ) as ran:  # fmt: skip
        assert ran.stderr.readline() == "Stopping…\n"
        _, said = ran.communicate("\n", timeout=60)
    assert said.strip() == "Error: interrupted"
    assert ran.returncode == 130


@pytest.mark.parametrize("module", ["aero_hil", "hil.cli"])
def test_python_m_runs_the_commands(module):
    """It once ended with 0 and did nothing: `validate --fault motor_dead:ring` said nothing and passed."""
    done = subprocess.run(
        [sys.executable, "-m", module, "no-such-command"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "Usage: aero-hil " in done.stderr


def test_another_package_named_serial_is_named(tmp_path):
    """What PyPI calls `serial` is not pyserial; installing the extra `hil` would not help."""
    (tmp_path / "serial.py").write_text("")
    command = [sys.executable, "-m", "hil.cli", "validate", "--dry-run"]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert f"{tmp_path}/serial.py is not the package `serial` that aero-hil needs" in line
    assert "extra" not in line


def test_the_backend_of_a_notebook_is_no_matter():
    command = [sys.executable, "-m", "hil.cli", "calibrate", "--help"]
    environment = os.environ | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
