"""Environments as the pages ask for, shared by the test processes of a session."""

import pytest
from extras import programs_of


@pytest.fixture(scope="session")
def installed(tmp_path_factory, worker_id):
    """Return the programs of a fresh environment after `pip install` with given arguments."""
    own = tmp_path_factory.getbasetemp()
    shared = own if worker_id == "master" else own.parent
    return lambda installation: programs_of(installation, shared)
