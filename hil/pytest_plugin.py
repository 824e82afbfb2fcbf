"""The pytest plugin behind `pytest --hil=TARGET`."""
