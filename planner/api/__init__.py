"""What a script calls: every command as a function of records, and what each of them answers.

`import planner` offers all of it by name (`planner.plan`, `planner.verify`, …); the command line is a thin
layer over it. One file a family of verbs; `answer` is what all answers have in common.
"""
