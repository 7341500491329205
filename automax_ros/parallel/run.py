"""Does pieces in this process, in local processes or by a cluster: the entry point to all three."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from automax_ros.parallel.job import Job, JobResult, Workers, result_of


def run_jobs(
    pieces: Sequence[Job],
    where: Workers,
    on_done: Callable[[JobResult], None] = lambda _: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> list[JobResult]:
    """Do pieces in parallel; return their outcomes in the order of the pieces, each once.

    ``on_done`` is called with each outcome as it arrives, in this thread. An error of a piece's work is the fault of
    this piece and ends nothing else. If a worker dies (killed, out of memory), its piece is tried again, at most
    ``MOST_TRIES`` times in all. If ``should_stop``, which is called now and then (between two pieces if ``jobs`` is 1),
    returns True, pieces in progress are abandoned, and only those that are done are returned; an exception of
    ``on_done`` and Ctrl-C also abandon them, and are raised. No process is left over in any of these cases.

    Raises:
        ClusterFault: Dask is not installed, or the cluster cannot be used.
    """
    if not pieces:
        return []
    done: dict[int, JobResult] = {}

    def take(number: int, item: JobResult) -> None:
        if number not in done:
            done[number] = item
            on_done(item)

    if where.scheduler is not None:
        from automax_ros.parallel.cluster import on_cluster

        on_cluster(pieces, where.scheduler, take, should_stop)
    elif where.processes == 1:
        for number, piece in enumerate(pieces):
            if should_stop():
                break
            take(number, result_of(piece))
    else:
        from automax_ros.parallel.local import in_processes

        in_processes(pieces, min(where.processes, len(pieces)), take, should_stop)
    return [done[number] for number in sorted(done)]
