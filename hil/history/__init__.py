"""The runs of one hand over months: its readings by date, and drift towards a limit."""
