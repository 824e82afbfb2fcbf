"""A hook of MkDocs: the built pages load nothing from the network."""

import re
from typing import Any

from mkdocs.exceptions import PluginError

REMOTE = re.compile(r"<(?:script|link|img|iframe|source|video)\b[^>]*?\b(?:src|href)=[\"']?(?:https?:)?//[^\s\"'>]+")


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Return a page as it is.

    Raises:
        PluginError: it loads a script, a style, a font or a picture from the network.
    """
    if found := REMOTE.findall(output):
        raise PluginError(f"{page.file.src_uri} loads from the network: {'; '.join(sorted(set(found)))}")
    return output
