"""Protocols and tables: how good the network is on rooms it has never seen."""
