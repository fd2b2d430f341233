"""`langflash lab eval rooms`: the network on rooms with furniture it has never seen."""
