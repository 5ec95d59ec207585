"""What can be set about the named strategies, a module a family, each loaded when one of its strategies is made."""
