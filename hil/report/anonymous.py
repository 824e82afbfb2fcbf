"""Texts without personal details: only words of this program's own sources, and numbers, remain.

A list of what to hide would miss names that nobody listed.
"""

import getpass
import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

from hil.recordings.provenance import OPERATOR, host
from hil.recordings.recording import Header

Scrub = Callable[[str], str]
HIDDEN = "***"
PACKAGES = ("aero", "hil")
"""Packages whose words are kept; subjects, verdicts and log lines are made of them."""
SOURCES = (".py", ".toml", ".j2")
WORD = re.compile(r"[^\W_]+")
ADDRESS = re.compile(
    r"\w[\w+.-]*://\S+|\b\d+(?:\.\d+){3}\b(?::\d+)?|\b(?:[0-9a-fA-F]{0,4}:){3,}[0-9a-fA-F]{0,4}|\S+@\S+"
)
"""URLs, IP addresses, and accounts at a computer."""
PATH = re.compile(r"(?<!\w)(?:[A-Za-z]:|~)?[/\\][^\s'\"]+|[^\s'\"/\\]+(?:[/\\][^\s'\"/\\]*){2,}")
"""Absolute paths, and relative ones of three parts; a unit such as m/s has two."""
NUMBER = re.compile(r"\d{1,6}[^\W\d_]{0,2}")
"""Numbers with a unit; a longer one may be a serial number."""


def scrubber(headers: Iterable[Header]) -> Scrub:
    """Return `known_words` that also hides the names of user and computer, of here and of `headers`."""
    users, hosts = set[str](), {host()}
    with suppress(OSError, KeyError):  # no such user, as in some containers
        users.add(getpass.getuser())
    users |= {os.environ.get(name, "") for name in ("USER", "LOGNAME", "USERNAME", OPERATOR)}
    for header in headers:
        users.add(header.operator)
        hosts.add(header.host)
    hosts |= {name.partition(".")[0] for name in hosts}
    # The longest first, because a name may begin with another.
    names = sorted(filter(None, users | hosts), key=len, reverse=True)
    pattern = re.compile(
        "|".join(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])" for name in names) or "(?!)", re.IGNORECASE
    )

    def scrub(text: str) -> str:
        return known_words(pattern.sub(HIDDEN, text))

    return scrub


def known_words(text: str) -> str:
    """Return a text with addresses, paths, and every word hidden that this program does not use itself."""
    for hidden in (ADDRESS, PATH):
        text = hidden.sub(HIDDEN, text)
    return WORD.sub(lambda found: found[0] if _is_known(found[0]) else HIDDEN, text)


def scrubbed(content: Any, scrub: Scrub, free: Collection[str]) -> Any:
    """Return JSON content with known words only; texts below the keys `free` are scrubbed too."""
    if isinstance(content, Mapping):
        return {
            known_words(name): _all(value, scrub) if name in free else scrubbed(value, scrub, free)
            for name, value in content.items()
        }
    if isinstance(content, list | tuple):
        return [scrubbed(value, scrub, free) for value in content]
    return _all(content, known_words)


def _all(content: Any, scrub: Scrub) -> Any:
    """Return JSON content with every text and key scrubbed."""
    if isinstance(content, Mapping):
        return {scrub(name): _all(value, scrub) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [_all(value, scrub) for value in content]
    return scrub(content) if isinstance(content, str) else content


def _is_known(word: str) -> bool:
    return NUMBER.fullmatch(word) is not None or word.lower() in _vocabulary()


@cache
def _vocabulary() -> frozenset[str]:
    """Words of this program's sources, in lower case."""
    texts = (one.read_text(encoding="utf-8") for name in PACKAGES for one in _sources(files(name)))
    return frozenset(word.lower() for text in texts for word in WORD.findall(text))


def _sources(folder: Traversable) -> Iterable[Traversable]:
    for one in folder.iterdir():
        if one.is_dir():
            yield from _sources(one)
        elif one.name.endswith(SOURCES):
            yield one
