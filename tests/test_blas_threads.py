import threading

import numpy as np  # noqa: F401  (loads the library that is limited)
import threadpoolctl

from drake_aerial.parallel import one_blas_thread


def threads():
    return [
        pool["num_threads"]
        for pool in threadpoolctl.threadpool_info()
        if pool["user_api"] == "blas"
    ]


def test_one_thread_inside_and_the_old_number_after():
    with threadpoolctl.threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        assert set(one_blas_thread(threads)()) == {1}
        assert threads() == before


def test_calls_within_a_call_and_beside_it_leave_its_limit():
    with threadpoolctl.threadpool_limits(limits=2, user_api="blas"):
        before = threads()

        @one_blas_thread
        def outer():
            seen = [one_blas_thread(threads)(), threads()]
            other = threading.Thread(target=lambda: seen.append(one_blas_thread(threads)()))
            other.start()
            other.join()
            return [*seen, threads()]

        assert all(set(numbers) == {1} for numbers in outer())
        assert threads() == before
