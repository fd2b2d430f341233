"""One module per command, imported only when it runs: `run(args, out) -> exit code or None`.

`out` is where results are printed: stdout, whatever `sys.stdout` is at that moment. What cannot be used, of
input, options or output, is a `LangFlashError`, said before anything is written.
"""
