"""Lines of a text field: each is taken once, whatever the server sees of the typing, and the field drops it."""

from hypothesis import given
from hypothesis import strategies as st

from hil.view.entered_lines import EnteredLines

WORDS = st.lists(st.text("abc ", min_size=1, max_size=6), min_size=1, max_size=5, unique=True)


@given(WORDS, st.data())
def test_each_line_is_taken_once_and_whole_whichever_texts_arrive(lines, data):
    """A person types; some texts never arrive, and the field is emptied only now and then."""
    field, entered, taken = "", EnteredLines(), []
    for line in lines:
        for key in f"{line}\n":
            field += key
            # The throttle may leave out any text but the last before a pause.
            if data.draw(st.booleans()):
                new, field_after = entered.take(field)
                taken += new
                # Emptied at once, or the person types on before the page is told.
                if data.draw(st.booleans()):
                    field = field_after
    assert [*taken, *entered.take(f"{field}end\n")[0]] == [*lines, "end"]


def test_the_same_line_is_taken_as_often_as_it_is_entered():
    entered = EnteredLines()
    for _ in range(3):
        assert entered.take("voltage\n") == (["voltage"], "")


def test_a_long_line_is_cut():
    assert [len(line) for line in EnteredLines().take("x" * 5000 + "\n")[0]] == [1000]
