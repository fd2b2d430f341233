"""What `langflash lab` and its commands may be told. Only the standard library is imported here."""

from ...words.shared import new_command
from .judging import add_bench_network, add_eval
from .training import add_labels, add_rooms, add_train


def add_lab(commands) -> None:
    """`langflash lab`. The command behind it is what `args.command` names."""
    lab = new_command(commands, "lab", "make and judge the weights, from a checkout")
    below = lab.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for add in (add_rooms, add_labels, add_train, add_eval, add_bench_network):
        add(below)
