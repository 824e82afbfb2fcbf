"""The cores of a virtual machine are kept from sleeping, by processes that end with whoever asked for them."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hil import awake, open_target

VIRTUAL = "processor\t: 0\nmodel name\t: any\nflags\t\t: fpu sse2 hypervisor lahf_lm\n"
BARE = "processor\t: 0\nmodel name\t: hypervisor\nflags\t\t: fpu sse2 nohypervisor lahf_lm\n"
PATIENCE_S = 20.0

needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="there is no /proc here")


def processes():
    """Return parent and session of every process that has not ended."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent, _, session, *_ = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        if state != "Z":
            found[int(stat.parent.name)] = (int(parent), int(session))
    return found


def children():
    """Return the processes that this one has started."""
    return {process for process, (parent, _) in processes().items() if parent == os.getpid()}


def turning():
    """Return the cores on which a process turns, two levels below this one and in another session."""
    mine, everything = children(), processes()
    below = [process for process, (parent, _) in everything.items() if parent in mine]
    apart = [process for process in below if everything[process][1] != os.getsid(0)]
    return sorted(core for process in apart for core in os.sched_getaffinity(process))


def every_core_turns():
    """Wait until each core has such a process below this one."""
    cores, until = sorted(os.sched_getaffinity(0)), time.monotonic() + PATIENCE_S
    while turning() != cores:
        assert time.monotonic() < until, turning()


@pytest.fixture
def virtual(tmp_path, monkeypatch):
    cpuinfo = tmp_path / "cpuinfo"
    cpuinfo.write_text(VIRTUAL)
    monkeypatch.setattr(awake, "CPUINFO", cpuinfo)
    return cpuinfo


def test_a_virtual_machine_is_told_by_its_flags():
    assert awake.is_virtual(VIRTUAL)
    assert not awake.is_virtual(BARE)
    assert not awake.is_virtual("")


@needs_proc
def test_every_core_has_something_to_do_until_the_end(virtual):
    before = children()
    with awake.cores_awake():
        every_core_turns()
    assert children() <= before


@needs_proc
def test_a_hand_on_a_pseudo_terminal_keeps_them_awake(virtual):
    with open_target("pty"):
        every_core_turns()


@needs_proc
def test_real_cores_are_left_alone(virtual):
    virtual.write_text(BARE)
    before = children()
    with awake.cores_awake():
        assert children() <= before


def test_no_cpuinfo_means_real_cores(virtual):
    virtual.unlink()
    with awake.cores_awake():
        pass


@needs_proc
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "interrupted"])
def test_nothing_turns_on_for_a_parent_that_is_gone(virtual, number):
    program = (
        "import pathlib, sys, signal; from hil import awake; awake.CPUINFO = pathlib.Path(sys.argv[1])\n"
        "with awake.cores_awake(): print('ready', flush=True); signal.pause()"
    )
    command = [sys.executable, "-c", program, str(virtual)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as parent:
        try:
            assert parent.stdout.readline() == "ready\n"
            parent.send_signal(number)
            parent.communicate(timeout=PATIENCE_S)  # the end of the output: all that inherited it have ended
        finally:
            parent.kill()
