"""Numbers and words on the command line, for every option of every command."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import typer.main

from attack import mutate
from attack.files import recorded
from attack.tables import MASTS, PATHS, SHORT, SPACE

if TYPE_CHECKING:
    from random import Random

    from attack.case import Case

# Arguments that give each command a short run time; the options in them are not drawn.
QUICK: dict[str, list[str]] = {
    "run": ["short.toml"],
    "paper evaluate": ["--scenario", "papier"],
    "paper search-controllers": ["--platform", "jetson"],
    "paper fit": ["--platform", "jetson"],
    "paper explore": ["--results", "nowhere"],
    "design bound": ["short.toml"],
    "record scan": ["iq.sigmf-meta", "--ssb-freq-hz", "3.5e9", "--scs-khz", "15"],
    "record aoa": ["iq.sigmf-meta"],
    "record synth": ["short.toml", "--duration-s", "0.1", "--out", "made"],
    "record locate": [
        "--recording", "angles.csv", "--odometry", "odometry.csv", "--site", "site.toml",
        "--vehicle", "vehicle.toml",
    ],
    "design profile": ["--sysfs-root", "sysfs"],
    "design sweep": ["short.toml", "--space", "space.toml", "--runs", "1"],
    "design select": ["."],
    "design balance": [],
    "paper codesign": ["--interpretation", "keine"],
    "design integrity": ["short.toml", "--fault", "keiner"],
    "design plan": ["short.toml", "--masts", "masts.csv"],
    "design import-paths": [
        "paths.csv", "--site", "site.toml", "--carrier-mhz", "3500", "--out", "paths.npz",
    ],
    "record survey": ["drive", "--site", "site.toml", "--vehicle", "vehicle.toml"],
    "design tune": ["short.toml", "--designs", "2", "--runs", "1", "--max-rms-m", "1"],
    "paper interpretations": [],
    "file columns": [],
}  # fmt: skip


@cache
def options(command: str) -> list[Any]:
    """Returns the options of a command that change its behaviour, from its parser."""
    from access_av.cli.main import app

    found: Any = typer.main.get_command(app)
    for word in command.split():
        found = found.commands[word]
    return [
        it
        for it in found.params
        if it.opts[0].startswith("--") and not it.is_flag and it.opts[0] not in QUICK[command]
    ]


def arguments(random: Random, case: Case) -> list[str]:
    """One command with one to three random options."""
    for name, content in recorded().items():
        case.write(name, content)
    case.write("short.toml", SHORT)
    case.write("masts.csv", MASTS)
    case.write("paths.csv", PATHS)
    case.write("space.toml", SPACE)
    command = random.choice(list(QUICK))
    words = [*command.split(), *QUICK[command]]
    known = options(command)
    for option in random.sample(known, min(len(known), random.choice((1, 1, 2, 3)))):
        words += [option.opts[0], _value(random, option)]
    if "--runs" in words and words[words.index("--runs") + 1].isdigit():
        at = words.index("--runs") + 1  # other numbers of runs are valid, but take long
        words[at] = words[at] if int(words[at]) < 5 or int(words[at]) > 10**5 else "3"
    if not known or random.random() < 0.1:
        words.append(_without_nul(random.choice(mutate.TEXTS)))
    return case.access_av(*words)


def _value(random: Random, option: Any) -> str:
    if option.opts[0] == "--set":
        return _without_nul(
            random.choice(
                ("site.rician_k_db", "vehicle.array.elements", "name", "a[0].b", "motion")
            )
            + random.choice(("=", "=", ""))
            + str(mutate.value(random, random.choice((1.0, "a", [1]))))
        )
    if random.random() < 0.7:
        found = mutate.number(random)
        return str(int(found) if random.random() < 0.6 and abs(found) < 1e30 else found)
    return _without_nul(random.choice(mutate.TEXTS))


def _without_nul(text: str) -> str:
    return text.replace("\0", "")[:100_000]
