"""The hardware suite on a pseudo-terminal, in real time, beside the other pages' commands.

`tox -e realtime` runs it, because it takes minutes of waiting and little else.
"""

import pytest
from pages import ROOT, run

pytestmark = pytest.mark.slow


def test_the_suite_passes_on_a_pseudo_terminal(tmp_path):
    ran = run(f"pytest -p no:cacheprovider {ROOT / 'tests' / 'hil'} --hil=pty", tmp_path)
    assert ran.returncode == 0, ran.stdout[-3000:]
