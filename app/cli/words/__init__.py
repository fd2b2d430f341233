"""What each command may be told. Only the standard library is imported here."""
