"""Many sets of photos in one run: which there are, who works on them, and what became of each.

`sets` reads them, `order` is what is asked of each, `ledger` remembers them, `dispatch` hands them to workers
(`processes` on this machine, `cluster` on Ray), `summary` shows them, and `run` joins all that. What a worker
does with a set is the caller's: a function that is opened once a worker. Nothing here imports torch.
"""
