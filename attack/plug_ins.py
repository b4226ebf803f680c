"""Plug-ins of a user that return invalid values."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from random import Random

    from attack.case import Case

ANSWERS = (
    "None", "True", "0", "1.0", "-1.0", "1e308", "math.nan", "math.inf", "-math.inf", "1j",
    "'left'", "[]", "{}", "()", "(1.0,)", "(1.0, 0.01)", "(1.0, 0.0)", "(1.0, -1.0)",
    "(1.0, 1e-300)", "(1.0, 1e300)", "(math.nan, 0.1)", "(0.0, 1e-9)", "(1, 2, 3)",
    "(1.0, 2.0, math.nan)", "(1e308, -1e308, 1e308)", "(1.0, 2.0, 3.0, 4)",
    "(0.0, 0.0, 0.0, np.eye(3))", "(0.0, 0.0, 0.0, -np.eye(3))",
    "(0.0, 0.0, 0.0, np.full((3, 3), np.nan))", "(0.0, 0.0, 0.0, np.eye(2))",
    "(0.0, 0.0, 0.0, [[1, 9, 0], [9, 1, 0], [0, 0, 1]])",
    "(0.0, 0.0, 0.0, [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]])", "(0.0, 0.0, 0.0, 1e300 * np.eye(3))",
    "np.zeros(3)", "np.zeros(8)", "np.zeros(360)", "np.ones(360, dtype=int)",
    "np.full(360, -np.inf)", "np.full(360, np.inf)", "np.full(360, np.nan)",
    "1e308 * np.ones(360)", "np.zeros((360, 2))", "np.arange(360.0)[::2]", "np.float32(1.0)",
    "np.array(1.0)", "10**400", "[True]", "[True, False]", "np.array([True, True])", "object()",
    "lambda: 1", "iter([1])", "1 / 0", "[][1]", "exec('raise SystemExit(3)')",
    "exec('raise StopIteration')", "recurse()",
    "exec('raise BaseException(chr(27) + 900 * chr(88))')", "access_av.simulate(SHORT)",
    "time.sleep(0.01)",
)  # fmt: skip

SCRIPT = """\
import math, time, warnings
warnings.simplefilter("ignore", UserWarning)
import numpy as np
import access_av

SHORT = access_av.Scenario.load("paper-real-odometry-2").with_overrides({{
    "motion.start_at_m": 299.0, "site.ssb.period_ms": 80.0}})
def recurse(): return recurse()
def answer(*arguments):
    return {answer}
class PlugIn:
    wake_up_time_s = {stated}
    def __init__(self, *start): self.start = start[2] if len(start) == 3 else None
    def __call__(self, *arguments): return {call}
    def listens(self, situation): return {listens}
    def odometry(self, *sample): return {odometry}
    def angle(self, *measured): return {angle}
    def pose(self, time_s): return {pose}
try:
    found = access_av.simulate(SHORT, threads=1, keep_trajectories=True, {place})
except (ValueError, TypeError, ArithmeticError, IndexError, RecursionError) as error:
    print(type(error).__name__, str(error)[:600])
    if len(str(error)) > 500: raise RuntimeError("a message of more than 500 characters")
except BaseException as error:
    # What a plug-in raises comes out as it went in.
    if type(error) not in (SystemExit, StopIteration, BaseException): raise
else:
    found.trajectories.write_parquet("trajectories.parquet")
    found.aoa_estimates.write_parquet("aoa_estimates.parquet")
"""


def plug_in(random: Random, case: Case) -> list[str]:
    """An estimator, a policy or a localizer that returns one invalid value."""
    place = random.choice(("estimator=answer", "policy=PlugIn", "localizer=PlugIn"))
    good = {
        "stated": "0.5",
        "call": "True",
        "listens": "True",
        "odometry": "None",
        "angle": "True",
        "pose": "self.start",
    }
    strange = {
        "policy=PlugIn": ("stated", "call", "listens"),
        "localizer=PlugIn": ("odometry", "angle", "pose", "pose"),
    }.get(place)
    answer = random.choice(ANSWERS)
    if strange is not None:
        good[random.choice(strange)] = answer.replace("answer()", "self.call()")
    if good["stated"] != "0.5":  # a class attribute
        good["stated"] = random.choice(ANSWERS[:28])
    return case.python(SCRIPT.format(answer=answer, place=place, **good))
