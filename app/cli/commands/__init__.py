"""One module per command, imported only when it runs: `run(args, out) -> exit code or None`.

`out` is where results are printed: stdout, whatever `sys.stdout` is at that moment.
"""
