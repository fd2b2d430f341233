"""Where the portable build starts: the program, or, as Python would, a module or a line for a process of
its own.

Exports, readers and workers start `sys.executable` again, which is this file here.
"""

import multiprocessing
import runpy
import sys

multiprocessing.freeze_support()

if sys.argv[1:2] == ["-m"]:
    module, sys.argv = sys.argv[2], sys.argv[2:]
    runpy.run_module(module, run_name="__main__", alter_sys=True)
elif sys.argv[1:2] == ["-c"]:
    line, sys.argv = sys.argv[2], ["-c", *sys.argv[3:]]
    exec(compile(line, "<line>", "exec"), {"__name__": "__main__"})
else:
    from langflash_core.__main__ import main

    sys.exit(main())
