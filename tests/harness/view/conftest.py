"""Leaves out what needs the extra `view` where that is not installed; in tox it is."""

from importlib.util import find_spec

collect_ignore = [] if find_spec("viser") else ["test_page.py"]
