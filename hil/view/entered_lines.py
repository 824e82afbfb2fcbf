"""Text fields of the page in which Enter ends a line, as at a prompt.

Each panel of viser's page sends at most one message in 50 ms and keeps only the latest one waiting. The submission of
a form, or its mark of unsubmitted changes, replaces a waiting text, so the server would see an older one. In a field of
several lines, the text itself carries Enter.
"""

from __future__ import annotations

from collections.abc import Callable

import viser

LONGEST = 1000
"""Length limit of a line, characters."""


class EnteredLines:
    """Lines of one field, from its successive texts, each of which may still begin with lines entered before."""

    def __init__(self) -> None:
        """Begin with an empty field."""
        self._entered = ""

    def take(self, text: str) -> tuple[list[str], str]:
        """Return the newly entered lines of a text, and what the field should hold afterwards."""
        late = text != self._entered and text.startswith(self._entered)
        *lines, rest = (text[len(self._entered) :] if late else text).split("\n")
        self._entered = text.removesuffix(rest)
        return [line[:LONGEST] for line in lines], rest


def add_prompt(gui: viser.GuiApi, label: str, on_line: Callable[[str], object]) -> viser.GuiTextHandle:
    """Append a text field; `on_line` receives each line when it is entered, and the field drops it."""
    field = gui.add_text(label, "", multiline=True)
    entered = EnteredLines()

    @field.on_update
    async def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:  # in the order of the texts, unlike a thread pool
        if event.client is not None:  # written by a user, not by the page itself
            lines, rest = entered.take(event.target.value)
            for line in lines:
                on_line(line)
            # mypy does not see a setter that is defined apart from its getter.
            event.target.value = rest  # type: ignore[misc]

    return field
