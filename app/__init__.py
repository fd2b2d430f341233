"""The desktop program: the window, the GL renderer, and the command line."""
