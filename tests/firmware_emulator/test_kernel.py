from hypothesis import given
from hypothesis import strategies as st

from firmware_emulator.kernel import TASK_YIELD, Kernel, Mutex, Signal, VirtualClock


@given(st.lists(st.floats(0, 100, allow_nan=False)))
def test_events_run_in_time_order_and_ties_in_the_order_of_scheduling(times):
    kernel = Kernel()
    seen = []
    for number, t in enumerate(times):
        kernel.call_at(t, lambda t=t, number=number: seen.append((kernel.now, t, number)))
    kernel.run_until(100)
    assert [(t, number) for _, t, number in seen] == sorted((t, number) for number, t in enumerate(times))
    assert all(now == t for now, t, _ in seen)
    assert kernel.now == 100


def test_a_task_that_waits_behind_runs_after_what_is_due_at_the_same_instant():
    kernel = Kernel()
    seen = []

    def task():
        yield 1.5
        seen.append("before")
        yield TASK_YIELD
        seen.append(("behind", kernel.now))

    kernel.spawn(task())
    kernel.run_until(1.0)
    kernel.call_at(1.5, seen.append, "other")
    kernel.run_until(2.0)
    assert seen == ["before", "other", ("behind", 1.5)]


def test_a_wait_tells_whether_the_signal_or_the_deadline_came_first():
    kernel = Kernel()
    signal = Signal(kernel)
    seen = []

    def waiter(deadline):
        seen.append(((yield signal, deadline), kernel.now))

    kernel.spawn(waiter(1.0))
    kernel.spawn(waiter(3.0))
    kernel.call_at(2.0, signal.fire)
    kernel.run_until(5.0)
    assert seen == [(False, 1.0), (True, 2.0)]


def test_a_lock_is_held_by_one_task_and_handed_on_in_turn():
    kernel = Kernel()
    lock = Mutex(kernel)
    seen = []

    def user(name):
        yield from lock.take()
        assert not lock.try_take()
        seen.append((name, kernel.now))
        yield kernel.now + 1.0
        lock.give()

    for name in "abc":
        kernel.spawn(user(name))
    kernel.run_until(10.0)
    assert seen == [("a", 0.0), ("b", 1.0), ("c", 2.0)]
    assert lock.try_take()


def test_virtual_time_never_goes_back_and_sleeping_runs_what_is_due():
    kernel = Kernel()
    clock = VirtualClock(kernel)
    seen = []
    kernel.call_at(1.0, lambda: seen.append(clock.now()))
    clock.sleep_until(2.0)
    clock.sleep_until(1.0)
    assert seen == [1.0]
    assert clock.now() == 2.0
    kernel.call_at(0.5, lambda: seen.append(clock.now()))
    clock.sleep_until(2.5)
    assert seen == [1.0, 2.0]


def test_no_time_passes_for_a_task_that_is_woken_in_the_middle_of_an_event():
    kernel = Kernel()
    signal = Signal(kernel)
    seen = []

    def waiter():
        yield signal
        yield 2.0
        seen.append(kernel.now)

    def event():
        signal.fire()
        seen.append(kernel.now)

    def firing():
        yield 1.0
        event()

    kernel.spawn(waiter())
    kernel.spawn(firing())
    kernel.run_until(3.0)
    assert seen == [1.0, 2.0]


def test_a_task_that_pauses_the_kernel_waits_for_its_next_run():
    kernel = Kernel()
    seen = []

    def task():
        yield 1.0
        kernel.pause()
        yield 2.0
        seen.append(kernel.now)

    kernel.spawn(task())
    kernel.run_until(3.0)
    assert (kernel.now, seen) == (1.0, [])
    kernel.run_until(3.0)
    assert (kernel.now, seen) == (3.0, [2.0])


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), max_size=12), st.integers(0, 12))
def test_tasks_run_in_the_order_of_the_queue_whether_they_take_its_way_or_not(waits, limit):
    def run(kernel):
        seen = []

        def task(number, steps):
            for step in steps:
                yield kernel.now + step
                seen.append((kernel.now, number))

        for number in range(3):
            kernel.spawn(task(number, [step for of, step in waits if of == number]))
        kernel.run_until(limit)
        return seen, kernel.now, kernel.next_event() is None

    queued = Kernel()
    queued.is_free_until = lambda _t: False
    assert run(Kernel()) == run(queued)
