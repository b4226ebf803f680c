"""Changed files: settings, recordings, logs, truth, results."""

from __future__ import annotations

import json
import tempfile
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import access_av
from access_av.tables.toml import tomllib
from attack import mutate

if TYPE_CHECKING:
    from random import Random

    from attack.case import Case

# Scripts that run the scenario of a valid settings file if it is short, and compute its bound.
TRY_SCENARIO = """\
import access_av
scenario = access_av.Scenario.load({name!r})
if scenario.size["ssbs"] < 30_000:
    found = access_av.simulate(scenario, threads=1, keep_trajectories=True)
    found.trajectories.write_parquet("trajectories.parquet")
    found.aoa_estimates.write_parquet("aoa_estimates.parquet")
    found.steps.write_parquet("steps.parquet")
    found.runs.write_parquet("runs.parquet")
    found.integrity, found.consistency
"""
TRY_BOUND = """\
import access_av
scenario = access_av.Scenario.load({name!r})
if scenario.size["ssbs"] < 30_000:
    found = access_av.bound(scenario, map_step_m=20.0)
    found.route.write_parquet("bound.parquet")
    found.site.write_parquet("map.parquet")
    found.summary()
"""


KINDS: dict[str, Any] = {
    "site": access_av.Site,
    "vehicle": access_av.Vehicle,
    "scenario": access_av.Scenario,
    "platform": access_av.Platform,
}


@cache
def settings(what: str, name: str) -> dict[str, Any]:
    """Returns a shipped file with all default values written out."""
    return tomllib.loads(KINDS[what].load(name).to_toml())


def _names(what: str) -> list[str]:
    return list(KINDS[what].names())


def settings_text(random: Random, case: Case) -> list[str]:
    """A settings file with changed bytes."""
    what = random.choice(list(KINDS))
    text = mutate.toml(settings(what, random.choice(_names(what))))
    return case.access_av(
        "file", "check", "--kind", what, case.write("x.toml", mutate.data(random, text.encode()))
    )


def settings_table(random: Random, case: Case) -> list[str]:
    """A settings file with changed values."""
    what = random.choice(list(KINDS))
    changed = mutate.table(random, settings(what, random.choice(_names(what))))
    return case.access_av("file", "check", "--kind", what, case.write("x.toml", changed))


def short_scenario(random: Random) -> dict[str, Any]:
    """Returns a shipped scenario with few SSBs and no stops, usually with a start near the end."""
    made = deepcopy(settings("scenario", random.choice(_names("scenario"))))
    made["motion"] |= {"start_at_m": random.choice((0.0, 250.0, 280.0)), "stops": []}
    made["site"]["ssb"]["period_ms"] = 80.0
    return made


def scenario(random: Random, case: Case) -> list[str]:
    """A scenario with a changed value; it is run if it is still valid."""
    name = case.write("x.toml", mutate.table(random, short_scenario(random)))
    return case.python(TRY_SCENARIO.format(name=name))


def at_the_limits(random: Random, case: Case) -> list[str]:
    """A scenario with numbers at the limits of their ranges, which is run."""
    made = short_scenario(random)
    schema = json.loads(access_av.Scenario.schema_json())
    numbers = [path for path in mutate.places(made) if _range(schema, path) is not None]
    for path in random.sample(numbers, min(len(numbers), random.choice((1, 2, 3)))):
        *steps, key = path
        holder: Any = made
        for step in steps:
            holder = holder[step]
        low, high = _range(schema, path) or (0.0, 1.0)
        holder[key] = type(holder[key])(random.choice((low, high)))
    script = random.choice((TRY_SCENARIO, TRY_SCENARIO, TRY_BOUND))
    return case.python(script.format(name=case.write("x.toml", made)))


def _range(schema: dict[str, Any], path: tuple[Any, ...]) -> tuple[float, float] | None:
    """Returns minimum and maximum of a number in the JSON Schema."""
    found = [schema]
    for step in (*path, None):
        resolved = []
        while found:
            one = found.pop()
            if "$ref" in one:
                found.append(schema["$defs"][one["$ref"].rsplit("/", 1)[1]])
            found += [it for key in ("oneOf", "anyOf", "allOf") for it in one.get(key, ())]
            resolved.append(one)
        if step is None:
            ranges = [
                (it["minimum"], it["maximum"])
                for it in resolved
                if {"minimum", "maximum"} <= it.keys()
            ]
            return ranges[0] if ranges else None
        found = [
            it["items"] if isinstance(step, int) else it["properties"][step]
            for it in resolved
            if (
                isinstance(it.get("items"), dict)
                if isinstance(step, int)
                else step in it.get("properties", {})
            )
        ]
    return None


@cache
def recorded() -> dict[str, bytes]:
    """Returns the files of a short drive that was recorded and located, by name."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        access_av.synthesize("paper-real-odometry-2", place, duration_s=0.3)
        drive = access_av.locate(
            str(place / "site.toml"),
            place / "odometry.csv",
            place / "iq.sigmf-meta",
            vehicle=str(place / "vehicle.toml"),
        )
        drive.write_mcap(place / "odometry.mcap")
        columns = [
            "time_s",
            "pci",
            "ssb_index",
            "phase_rad",
            "phase_sigma_rad",
            "angle_rad",
            "snr_db",
        ]
        drive.angles.select(columns).write_csv(place / "angles.csv")
        drive.angles.select(columns).write_parquet(place / "angles.parquet")
        drive.poses.select("x_m", "y_m").write_csv(place / "road.csv")
        return {file.name: file.read_bytes() for file in place.iterdir()}


def _locate(case: Case, random: Random, *changed: str) -> list[str]:
    for name, content in recorded().items():
        if name in changed:
            is_text = name.endswith((".csv", ".tum"))
            content = (
                mutate.text(random, content.decode()) if is_text else mutate.data(random, content)
            )
        case.write(name, content)
    odometry = "odometry.mcap" if "odometry.mcap" in changed else "odometry.csv"
    if odometry == "odometry.mcap" and random.random() < 0.5:
        # A bag of two files: one of them, or neither, is unchanged.
        (case.folder / "bag").mkdir()
        second = random.choice((recorded()[odometry], mutate.data(random, recorded()[odometry])))
        case.write("bag/a.mcap", second)
        case.write("bag/b.mcap", (case.folder / odometry).read_bytes())
        listed = mutate.data(random, b"relative_file_paths:\n  - a.mcap\n  - b.mcap\n")
        case.write("bag/metadata.yaml", listed)
        odometry = "bag"
    angles = "angles.parquet" if "angles.parquet" in changed else "angles.csv"
    options = random.choice(([], [], ["--smooth"], ["--start", "unknown"], ["--start", "0,0,0"]))
    return case.access_av(
        "record", "locate", "--recording", angles, "--odometry", odometry,
        "--site", "site.toml", "--vehicle", "vehicle.toml", "--truth", "truth.tum", "--out", "out",
        *options,
    )  # fmt: skip


def odometry(random: Random, case: Case) -> list[str]:
    """An odometry log."""
    return _locate(case, random, random.choice(("odometry.csv", "odometry.mcap")))


def angles(random: Random, case: Case) -> list[str]:
    """An angle log."""
    return _locate(case, random, random.choice(("angles.csv", "angles.csv", "angles.parquet")))


def truth(random: Random, case: Case) -> list[str]:
    """A TUM trajectory."""
    return _locate(case, random, "truth.tum")


def recording(random: Random, case: Case) -> list[str]:
    """A SigMF recording with changed data or metadata, as bytes or as a table."""
    held = dict(recorded())
    if random.random() < 0.3:
        held["iq.sigmf-data"] = mutate.data(random, held["iq.sigmf-data"])
    elif random.random() < 0.2:
        held["iq.sigmf-meta"] = mutate.data(random, held["iq.sigmf-meta"])
    else:
        metadata = mutate.table(random, json.loads(held["iq.sigmf-meta"]))
        held["iq.sigmf-meta"] = json.dumps(metadata).encode("utf-8", "surrogatepass")
    for name, content in held.items():
        case.write(name, content)
    command = random.choice(("scan", "aoa", "aoa", "locate", "angles"))
    settings_of = ("--site", "site.toml", "--vehicle", "vehicle.toml", "--out", "out")
    if command == "angles":
        return case.access_av("record", "angles", "iq.sigmf-meta", *settings_of)
    if command == "locate":
        return case.access_av(
            "record",
            "locate",
            "--recording",
            "iq.sigmf-meta",
            "--odometry",
            "odometry.csv",
            *settings_of,
        )
    quick = ["--ssb-freq-hz", "3.5e9", "--scs-khz", "15"] if command == "scan" else []
    return case.access_av(
        "record", command, "iq.sigmf-meta", *quick, *random.choice(([], ["--json"]))
    )


def road_file(random: Random, case: Case) -> list[str]:
    """The survey of a site's road."""
    name = random.choice(("road.csv", "road.geojson"))
    line = {"type": "LineString", "coordinates": [[11.0, 48.0], [11.001, 48.0], [11.002, 48.001]]}
    held = recorded()["road.csv"] if name == "road.csv" else json.dumps(line).encode()
    if name == "road.csv" and random.random() < 0.7:
        held = mutate.lines(random, held.decode()).encode("utf-8", "surrogatepass")
    elif name == "road.geojson" and random.random() < 0.7:
        held = json.dumps(mutate.table(random, line)).encode("utf-8", "surrogatepass")
    else:
        held = mutate.data(random, held)
    case.write(name, held)
    site = deepcopy(settings("site", "yard"))
    site["road"] = {"file": name}
    return case.access_av("file", "check", "--kind", "site", case.write("site.toml", site))
