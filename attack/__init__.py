"""Robustness campaign: random user input, files and plug-ins; ``make attack`` runs it.

A *case* is a folder of files and a command that runs in it. :mod:`attack.kinds` lists the kinds of
cases; a case is determined by its kind, number and seed. Cases run in worker processes with limits
on memory and time (:mod:`attack.worker`). :mod:`attack.verdict` finds the faults of a case.
"""
