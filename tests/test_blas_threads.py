import numpy as np  # noqa: F401  (loads the library that is limited)
import threadpoolctl

from drake_aerial.blas_threads import one_blas_thread


def threads():
    return [pool["num_threads"] for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"]


def test_one_thread_inside_and_the_old_number_after():
    with threadpoolctl.threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        assert set(one_blas_thread(threads)()) == {1}
        assert threads() == before
