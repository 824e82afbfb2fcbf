"""Dialogue with the person at the hand: typed questions, terminal, page, session of a case."""
