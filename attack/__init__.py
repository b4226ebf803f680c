"""Attacks ACCESS-AV with what a user may type, feed or plug in; ``make attack`` runs it.

A *case* is a folder of files and a command that is run in it; :mod:`attack.kinds` lists the kinds
of cases, each made from nothing but a seed. Cases run in worker processes with limits on memory
and time (:mod:`attack.worker`); :mod:`attack.verdict` says what is wrong with what came of one.
"""
