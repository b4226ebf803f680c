"""Tables and figures of a user: results, masts, paths, a fleet, a design space."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.tables.columns import GLOSSARY, TABLES
from access_av.tables.toml import shipped
from attack import mutate
from attack.files import recorded

if TYPE_CHECKING:
    from random import Random

    from attack.case import Case

SHORT = 'extends = "paper-real-odometry-2"\nname = "short"\n[motion]\nstart_at_m = 296.0\n'
MASTS = "name,x_m,y_m,z_m\nnorth,0,45,8\neast,60,10,8\nsouth,5,-40,8\n"
PATHS = "x_m,y_m,z_m,pci,gain_re,gain_im,delay_s,azimuth_rad,elevation_rad\n" + "".join(
    f"{x_m},0,1.5,{pci},1e-4,1e-5,{delay_s},0.4,0.1\n"
    for x_m in (0, 2, 4)
    for pci in (101, 102)
    for delay_s in (3e-6, 4e-6)
)
SPACE: dict[str, Any] = {
    "vehicle": {
        "platform": {"name": ["jetson-agx-xavier-engine"], "mode": [0, 2]},
        "wake_up": {
            "base_ms": [20.0, 80.0],
            "target_error_m": {"low": 0.1, "high": 1.0, "log": True},
        },
    }
}


def held(name: str) -> dict[str, list[Any]]:
    """Returns a table of the results, by name."""
    text = {"energy_provenance": "fitted", "interpretation": "gate", "campaign": "adaptive"}
    return {
        column: [
            {"text": text.get(column, "music"), "true or false": True}.get(unit, 1.0)
            for _ in range(8)
        ]
        for column in TABLES["operating_points"].of(f"`{name}.parquet`")
        if (unit := GLOSSARY[column].unit)
    }


def results(random: Random, case: Case) -> list[str]:
    """A folder of results, and a command that reads it."""
    name, command = random.choice(
        (
            ("operating_points", ("paper", "explore", "--results", ".", "--max-energy-j", "1000")),
            ("designs", ("design", "select", ".", "--max-energy-j", "1000")),
        )
    )
    table = held(name)
    choice = random.random()
    if choice < 0.5:
        row = mutate.table(random, {name: values[0] for name, values in table.items()})
        table = {name: [value] * 8 for name, value in row.items()}
    file = io.BytesIO()
    try:
        pl.DataFrame(table, strict=False).write_parquet(file)
    except (pl.exceptions.PolarsError, TypeError, ValueError, OverflowError):
        file.write(b"PAR1")  # no Parquet table can contain these columns
    content = file.getvalue() if choice < 0.6 else mutate.data(random, file.getvalue())
    case.write(f"{name}.parquet", content)
    return case.access_av(*command, "--json")


def given(random: Random, case: Case) -> list[str]:
    """A table of masts or paths."""
    case.write("site.toml", recorded()["site.toml"])
    name, command = random.choice(
        (
            ("masts.csv", ("design", "plan", "short.toml", "--masts")),
            (
                "paths.csv",
                ("design", "import-paths", "--carrier-mhz", "3500", "--site", "site.toml"),
            ),
        )
    )
    text = {"masts.csv": MASTS, "paths.csv": PATHS}[name]
    changed = mutate.text(random, text)
    case.write("short.toml", SHORT)
    return case.access_av(*command, case.write(name, changed), "--out", "made.npz")


def figures(random: Random, case: Case) -> list[str]:
    """The figures of a fleet, or a design space."""
    if random.random() < 0.6:
        fleet = mutate.table(random, shipped("economics", "balance.toml"))
        return case.access_av("design", "balance", case.write("fleet.toml", fleet))
    case.write("short.toml", SHORT)
    space = case.write("space.toml", mutate.table(random, SPACE))
    return case.access_av("design", "sweep", "short.toml", "--space", space, "--runs", "1")
