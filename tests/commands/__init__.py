"""The commands from outside: what stands on stdout and stderr, exit codes, files, refusals.

Most tests call the program's `main` in this process, which is what the console script does; a few start a
process of their own, where the terminal, the environment or a broken pipe matter.
"""
