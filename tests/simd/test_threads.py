"""`Threads` runs a kernel on every item once."""

import threading

import pytest

from lgmd_gym.kernels.threads import Threads


@pytest.fixture
def make_threads():
    """Return a function that makes `Threads`, whose workers end with the test."""
    made = []

    def make(count):
        made.append(Threads(count))
        return made[-1]

    yield make
    for threads in made:
        if threads._pool is not None:
            threads._pool.shutdown()


@pytest.mark.parametrize("count", [1, 2, 3, 8])
@pytest.mark.parametrize("num", [1, 2, 3, 7, 8, 64, 1000])
def test_every_item_is_in_one_part(make_threads, count, num):
    calls = []
    make_threads(count).run(lambda *arguments: calls.append(arguments), num, ("x",))
    assert {rest for *_, rest in calls} == {"x"}
    assert sorted(i for first, last, _ in calls for i in range(first, last)) == list(range(num))
    assert all(first < last for first, last, _ in calls)
    assert len(calls) <= 2 * count


def test_a_fast_thread_takes_the_small_parts_of_a_slow_one(make_threads):
    """The first part lasts until the other thread has taken all others."""
    done, release = [], threading.Event()

    def kernel(first, last):
        if first == 0:
            assert release.wait(10)
        done.append((first, last))
        if len(done) == 3:
            release.set()

    make_threads(2).run(kernel, 100, ())
    assert done == [(35, 70), (70, 85), (85, 100), (0, 35)]
