"""An environment variable that hides every package but those that some extras of aero-hil bring."""

import os
import re
from importlib.metadata import PackageNotFoundError, distribution, packages_distributions
from pathlib import Path

HIDING = """\
import importlib.machinery
import sys

class Finder(importlib.machinery.PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if path is None and name in {hidden!r} else super().find_spec(name, path, target)

sys.meta_path[sys.meta_path.index(importlib.machinery.PathFinder)] = Finder
"""


def brought(requirement):
    """Return the names of the distributions that a requirement such as `aero-hil[hil]` brings, itself included."""
    found, todo = set(), [requirement]
    while todo:
        name, asked = re.match(r"([\w.-]+)\s*(?:\[([^\]]*)\])?", todo.pop()).groups()
        key = (re.sub(r"[-_.]+", "-", name).lower(), frozenset(re.findall(r"[\w-]+", asked or "")))
        if key in found:
            continue
        found.add(key)
        try:
            needs = distribution(name).requires or ()
        except PackageNotFoundError:  # for another platform or Python
            continue
        for need in needs:
            plain, _, marker = need.partition(";")
            extra = re.search(r"extra\s*==\s*['\"]([\w-]+)['\"]", marker)
            if extra is None or extra.group(1) in key[1]:
                todo.append(plain)
    return {name for name, _ in found}


def hiding_others(folder: Path, *requirements):
    """Write a module that hides the other packages; return the variables under which Python runs it at its start."""
    # pytest imports the plugins of whatever is installed.
    kept = set.union(*map(brought, (*requirements, "pip", "setuptools", "pytest-xdist", "hypothesis")))
    hidden = {
        module
        for module, names in packages_distributions().items()
        if not any(re.sub(r"[-_.]+", "-", name).lower() in kept for name in names)
    }
    folder.mkdir(exist_ok=True)
    (folder / "sitecustomize.py").write_text(HIDING.format(hidden=hidden), encoding="utf-8")
    return {"PYTHONPATH": os.pathsep.join(filter(None, (str(folder), os.environ.get("PYTHONPATH"))))}
