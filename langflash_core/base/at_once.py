"""Steps that do not wait for each other, such as those of single photos, on as many threads as torch has.

What is done for a photo by numpy and scipy takes one thread each. Every step computes alone, so what comes
out has, on one machine, the same bits as one after the other with one thread.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

import torch

Item = TypeVar("Item")
Made = TypeVar("Made")


MOST = 4
"""Steps under way, at most: each holds up to a hundred megabytes."""


def at_once(make: Callable[[Item], Made], items: Iterable[Item]) -> Iterator[Made]:
    """What `make` gives for each item, in order; as many are under way as torch has threads, up to `MOST`,
    and with one thread the next begins when it is asked for.

    Whoever stops asking, or an error, ends what has not begun; what is under way is waited for.
    """
    threads = torch.get_num_threads()
    most = min(threads, MOST)
    if most == 1:
        yield from map(make, items)
        return
    learns = torch.is_grad_enabled()

    def alone() -> None:
        # Those of torch's own pool would wait for each other at every call.
        torch.set_num_threads(1)
        torch.set_grad_enabled(learns)

    pool = ThreadPoolExecutor(most, "langflash-steps", alone)
    try:
        under_way: deque[Future[Made]] = deque()
        for item in items:
            under_way.append(pool.submit(make, item))
            if len(under_way) >= most:
                yield under_way.popleft().result()
        while under_way:
            yield under_way.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)
        torch.set_num_threads(threads)  # it is also what threads begin with that first compute after this
