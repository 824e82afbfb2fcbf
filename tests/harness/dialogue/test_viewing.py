"""Progress while somebody looks at a hand."""

from hil.dialogue.viewing import telling


class Notes:
    """Keeps what is noted."""

    def __init__(self):
        self.noted = []

    def note(self, text):
        self.noted.append(text)


def test_every_progress_is_passed_on_and_each_new_action_is_noted_once():
    observer, passed = Notes(), []
    tell = telling(observer, lambda done, doing: passed.append((done, doing)))
    calls = [(0.1, "opens"), (0.2, "opens"), (0.3, "closes"), (0.4, "closes"), (0.5, "opens")]
    for done, doing in calls:
        tell(done, doing)
    assert passed == calls
    assert observer.noted == ["opens", "closes", "opens"]
