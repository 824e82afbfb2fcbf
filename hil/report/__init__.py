"""The report: one self-contained HTML page about a judged run, and the folder it lies in."""
