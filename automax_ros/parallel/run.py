"""Does pieces, wherever: the one door to the forms below."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from automax_ros.parallel.job import Job, JobResult, Workers, result_of


def run_pieces(
    pieces: Sequence[Job],
    where: Workers,
    on_done: Callable[[JobResult], None] = lambda _: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> list[JobResult]:
    """Do pieces side by side; return what became of them in their order, each once.

    ``on_done`` is told of each as it comes, here, in this thread. An error of a piece's work is the fault of this piece
    and ends nothing. A worker that dies (killed, out of memory) costs its piece another try, at most ``MOST_TRIES`` in
    all. When ``should_stop`` says so, which is asked every now and then (between two pieces where ``jobs`` is 1), what
    is under way is given up, and only the pieces that are done are returned; so it is with every exception of
    ``on_done`` and with Ctrl-C, which pass through. No process is left over in any of these cases.

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
        _here(pieces, take, should_stop)
    else:
        from automax_ros.parallel.local import in_processes

        in_processes(pieces, min(where.processes, len(pieces)), take, should_stop)
    return [done[number] for number in sorted(done)]


def _here(pieces: Sequence[Job], take: Callable[[int, JobResult], None], should_stop: Callable[[], bool]) -> None:
    for number, piece in enumerate(pieces):
        if should_stop():
            return
        take(number, result_of(piece))
