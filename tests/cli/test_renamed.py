"""Names that were replaced are rejected with the new name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl
import pytest

from access_av import Scenario, SettingsError
from access_av.errors import InputError
from access_av.tables import renamed, validation
from access_av.tables.columns import GLOSSARY, TABLES
from conftest import commands

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

KINDS = ("plant", "site", "vehicle", "scenario", "platform", "--kind")
# A command that has the option under its new name, unless the table names the command.
COMMANDS = {
    "--vary": ["run", "yard"],
    "--compare": ["run", "yard"],
    "--reading": ["paper", "evaluate"],
    "--unknowns": ["paper", "evaluate"],
    "--always-mend": ["study", "bends"],
    "--german": ["file", "export", "trip-2", "road.csv"],
    "--mismatch": ["design", "integrity", "yard"],
    "--hypotheses": ["design", "integrity", "yard"],
    "integrity --heads": ["design", "integrity", "yard"],
    "new --heads": ["file", "new", "plant", "mine.toml"],
    "--shard": ["design", "sweep", "yard"],
    "--dask": ["paper", "evaluate"],
}


@pytest.mark.parametrize(("old", "new"), renamed.names("options").items())
def test_old_options_are_rejected_with_the_new_name(
    access_av: Callable[..., Finished], old: str, new: str
) -> None:
    command = COMMANDS[old]
    done = access_av(*command, old.split()[-1])
    assert done.code == 2
    text = " ".join(done.err.replace("│", " ").split())
    assert f"renamed in version 0.2.0: write {new}" in text, done.err
    option = new.split()[0]
    is_grouped = command[0] in ("paper", "design", "file")
    assert option in access_av(*command[: 1 + is_grouped], "--help").out


@pytest.mark.parametrize(("old", "new"), renamed.names("commands").items())
def test_old_commands_are_rejected_with_the_new_name(
    access_av: Callable[..., Finished], old: str, new: str
) -> None:
    done = access_av(*old.split(), columns=200)
    assert done.code == 2
    assert f"'{old}'. It was renamed in version 0.2.0: write {new}" in " ".join(done.err.split())
    arguments = [word for word in new.split() if word not in KINDS]
    assert access_av(*arguments, "--help").code == 0
    assert not {*commands()} & {old}


def test_command_lines_of_earlier_results_are_translated() -> None:
    for old, new in {
        "designs paper --space space.toml": "design sweep paper --space space.toml",
        "integrity yard --hypotheses --heads 4": (
            "design integrity yard --fault-scale 1,3,10 --num-heads 4"
        ),
        "run yard --vary site.rician_k_db=1,2": "run yard --sweep site.rician_k_db=1,2",
        "evaluate --reading=gate": "paper evaluate --interpretation=gate",
        "design sweep paper": "design sweep paper",
        "study bends": "study bends",
    }.items():
        assert renamed.current(old.split()) == new.split()


def test_start_scratch_is_rejected_with_the_new_value(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    for name in ("odometry.csv", "angles.csv"):
        (tmp_path / name).write_text("time_s\n")
    arguments = ["record", "locate", "--odometry", "odometry.csv", "--recording", "angles.csv"]
    done = access_av(*arguments, "--site", "yard", "--vehicle", "carrier", "--start", "scratch")
    assert done.code == 2
    assert "write --start unknown" in " ".join(done.err.split()), done.err


def test_old_settings_keys_are_rejected_with_the_new_name() -> None:
    scenario = Scenario.load("yard")
    tables = {"serving_ssb": "wake_up.", "fault_probability.all_radio_heads": "integrity."}
    for old, new in renamed.names("keys").items():
        parents = "" if old.startswith(("truth.", "channel.")) else f"vehicle.{tables.get(old, '')}"
        with pytest.raises(SettingsError) as refused:
            scenario.with_overrides({f"{parents}{old}": 0.5})
        message = f"`{parents}{old}` was renamed in version 0.2.0: write `{parents}{new}`"
        assert message in str(refused.value)


def test_new_keys_exist(access_av: Callable[..., Finished]) -> None:
    schema = access_av("file", "schema", "scenario").out
    for new in renamed.names("keys").values():
        assert f'"{new.split(".")[-1]}"' in schema, new


def test_old_columns_are_rejected_with_the_new_name() -> None:
    for old, new in renamed.names("columns").items():
        with pytest.raises(InputError, match=f"`{old}` was renamed .*: write `{new}`"):
            validation.check(pl.DataFrame({old: [1.0]}), "mine.csv", numbers=[new])
    rows = pl.DataFrame({"time_s": [0.0], "reading": ["gate"]})
    with pytest.raises(InputError, match="write `interpretation`"):
        validation.check_types(
            rows, "mine.parquet", "operating_points", "`operating_points.parquet`"
        )


def test_new_columns_and_tables_exist() -> None:
    keys_of_studies = {"nominal", "poor_los", "integrity_failures"}
    assert set(renamed.names("columns").values()) - keys_of_studies <= GLOSSARY.keys()
    assert set(renamed.names("tables").values()) <= TABLES.keys()
