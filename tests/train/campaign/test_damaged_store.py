"""A campaign whose store is damaged ends with one line."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner
from damaged_files import damaged
from drawn import drawn

from hil.cli import main
from train.campaign.store import NAME, StoreError, opened


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    line = f"campaign --healthy 1 --only presence --workers 1 --out {folder}"
    assert CliRunner().invoke(main, line.split()).exit_code == 0
    return folder


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_store_gives_its_outcomes_or_one_line(campaign, seed, tmp_path):
    content = (campaign / NAME).read_bytes()
    (tmp_path / NAME).write_bytes(damaged(content, seed))
    with opened(campaign, read_only=True) as good:
        right = list(good.outcomes())
    try:
        with opened(tmp_path, read_only=True) as store:
            found = list(store.outcomes())
    except StoreError as error:
        assert str(tmp_path / NAME) in str(error)  # noqa: PT017
    else:
        assert found in (right, [])


@pytest.mark.parametrize(
    "line", drawn(["hil.cli campaign --healthy 1 --only presence --out D", "train.limits --out D"], 1)
)
def test_every_command_says_that_a_store_is_damaged(campaign, line, tmp_path):
    shutil.copytree(campaign, tmp_path / "D")
    path = tmp_path / "D" / NAME
    content = bytearray(path.read_bytes())
    content[4096 * 3 : 4096 * 4] = np.random.default_rng(0).bytes(4096)
    content[len(content) // 2 :] = np.random.default_rng(1).bytes(len(content) - len(content) // 2)
    path.write_bytes(content)
    command = [sys.executable, "-m", *line.split()]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    assert NAME in result.stderr.splitlines()[-1]
