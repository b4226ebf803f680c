"""Names that were replaced are rejected with the new name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl
import pytest

from access_av import Scenario, SettingsError
from access_av.errors import InputError
from access_av.tables import renamed, validation
from access_av.tables.columns.glossary import GLOSSARY
from access_av.tables.columns.tables import TABLES

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

# A command that has the option under its new name, unless the table names the command.
COMMANDS = {
    "--vary": ["run", "yard"],
    "--compare": ["run", "yard"],
    "--reading": ["evaluate"],
    "--unknowns": ["evaluate"],
    "--always-mend": ["study", "bends"],
    "--german": ["export", "trip-2", "road.csv"],
    "--mismatch": ["integrity", "yard"],
    "--hypotheses": ["integrity", "yard"],
    "integrity --heads": ["integrity", "yard"],
    "new --heads": ["new", "plant", "mine.toml"],
}


@pytest.mark.parametrize(("old", "new"), renamed.names("options").items())
def test_old_options(access_av: Callable[..., Finished], old: str, new: str) -> None:
    command = COMMANDS[old]
    done = access_av(*command, old.split()[-1])
    assert done.code == 2
    text = " ".join(done.err.replace("│", " ").split())
    assert f"renamed in version 0.2.0: write {new}" in text, done.err
    option = new.split()[0]
    assert option in access_av(*command[: 2 if command[0] == "new" else 1], "--help").out


@pytest.mark.parametrize(("old", "new"), renamed.names("commands").items())
def test_old_commands(access_av: Callable[..., Finished], old: str, new: str) -> None:
    done = access_av(old)
    assert done.code == 2
    assert f"write {new}" in " ".join(done.err.split()), done.err
    assert access_av(new, "--help").code == 0


def test_the_old_word_for_an_unknown_start(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    for name in ("odometry.csv", "angles.csv"):
        (tmp_path / name).write_text("time_s\n")
    arguments = ["locate", "--odometry", "odometry.csv", "--recording", "angles.csv"]
    done = access_av(*arguments, "--site", "yard", "--vehicle", "carrier", "--start", "scratch")
    assert done.code == 2
    assert "write --start unknown" in " ".join(done.err.split()), done.err


def test_old_keys() -> None:
    scenario = Scenario.load("yard")
    tables = {"serving_ssb": "wake_up.", "fault_probability.all_radio_heads": "integrity."}
    for old, new in renamed.names("keys").items():
        parents = "" if old.startswith(("truth.", "channel.")) else f"vehicle.{tables.get(old, '')}"
        with pytest.raises(SettingsError) as refused:
            scenario.with_overrides({f"{parents}{old}": 0.5})
        message = f"`{parents}{old}` was renamed in version 0.2.0: write `{parents}{new}`"
        assert message in str(refused.value)


def test_new_keys_exist(access_av: Callable[..., Finished]) -> None:
    schema = access_av("scenario", "schema").out
    for new in renamed.names("keys").values():
        assert f'"{new.split(".")[-1]}"' in schema, new


def test_old_columns() -> None:
    for old, new in renamed.names("columns").items():
        with pytest.raises(InputError, match=f"`{old}` was renamed .*: write `{new}`"):
            validation.check(pl.DataFrame({old: [1.0]}), "mine.csv", numbers=[new])
    rows = pl.DataFrame({"time_s": [0.0], "reading": ["gate"]})
    with pytest.raises(InputError, match="write `interpretation`"):
        validation.check_types(rows, "mine.parquet", "operating_points")


def test_new_columns_and_tables_exist() -> None:
    keys_of_studies = {"nominal", "poor_los", "integrity_failures"}
    assert set(renamed.names("columns").values()) - keys_of_studies <= GLOSSARY.keys()
    assert set(renamed.names("tables").values()) <= TABLES.keys()
