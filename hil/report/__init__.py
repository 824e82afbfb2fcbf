"""Report of a judged run: one self-contained HTML page, and the result folder."""
