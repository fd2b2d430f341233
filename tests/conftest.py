"""What every test shares."""

import os

# One thread a process, also in the processes that tests start: the tests' arrays are small, and
# on a busy machine threads that wait for each other cost up to fifty times what they save.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import torch

torch.set_num_threads(int(os.environ["OMP_NUM_THREADS"]))
