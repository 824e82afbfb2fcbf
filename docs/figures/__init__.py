"""The measured figures of README.md and docs/: each table is written into its page by the function that measures it.

`python -m figures` writes them, `python -m figures --check` compares them. A page has a marker for `cog`:

    <!-- [[[cog cog.out(table("validation.staircase", cog.previous)) ]]] -->
    ...
    <!-- [[[end]]] -->
"""

from __future__ import annotations

from figures.sources import table

__all__ = ["table"]
