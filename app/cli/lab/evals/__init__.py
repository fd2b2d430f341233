"""What `langflash lab eval` does, a module an action."""
