"""Hypothesis profiles (`dev` by default, `HYPOTHESIS_PROFILE=ci|nightly` for more examples), and Ctrl-C."""

import os
import signal
from importlib.util import find_spec

# Who only runs tests/hil on a hand has pytest and no Hypothesis.
if find_spec("hypothesis"):
    from hypothesis import HealthCheck, settings

    # No deadline: the machine may be busy, and time in a test is virtual. Fixtures that Hypothesis warns about are
    # factories here, which give every example its own.
    settings.register_profile(
        "dev", max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
    )
    settings.register_profile("ci", settings.get_profile("dev"), max_examples=60, derandomize=True)
    settings.register_profile("nightly", settings.get_profile("dev"), max_examples=2000)
    settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "dev"))

# A shell starts what it runs in the background with Ctrl-C ignored, and so would programs be that tests interrupt;
# `nohup` ignores the end of its terminal.
for name, usual in (("SIGINT", signal.default_int_handler), ("SIGHUP", signal.SIG_DFL)):
    number = getattr(signal, name, None)  # Windows has no SIGHUP
    if number is not None and signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, usual)
