"""What `langflash eval` does, a module an action."""
