"""Settings as plain data."""

from __future__ import annotations

import json

import pytest

import access_av
from access_av import _core
from access_av.settings import as_dict, platform_name, ssb_period_s
from conftest import ROOT

# Maximum number of distinct names of keys in all kinds of settings files.
MOST_KEYS = 240

KINDS = ("Site", "Vehicle", "Scenario", "Plant", "Platform")


@pytest.mark.parametrize("kind", KINDS)
def test_dictionaries_have_the_keys_of_the_schema(kind: str) -> None:
    of = getattr(_core, kind)
    schema = json.loads(of.schema_json())
    for name in of.names():
        settings = of.load(name)
        found = as_dict(settings)
        assert {*schema["required"]} <= found.keys() <= schema["properties"].keys()
        assert found["name"] == settings.name
        found["name"] = "changed"
        assert as_dict(settings)["name"] == settings.name


def test_changed_keys_are_in_the_dictionary() -> None:
    site = access_av.Site.load("yard").with_overrides({"ssb.period_ms": 160.0})
    assert ssb_period_s(site) == pytest.approx(0.16)
    vehicle = access_av.Vehicle.load("tugger").with_overrides(
        {"platform.name": "raspberry-pi-5", "platform.mode": 0}
    )
    assert platform_name(vehicle) == "raspberry-pi-5"


def test_only_one_module_reads_settings_as_json() -> None:
    package = ROOT / "python/access_av"
    readers = [it for it in package.rglob("*.py") if ".to_json()" in it.read_text("utf-8")]
    assert readers == [package / "settings.py"]


def test_settings_have_few_names() -> None:
    schemas = [json.loads(getattr(_core, kind).schema_json()) for kind in KINDS]
    tables = [it for schema in schemas for it in (schema, *schema["$defs"].values())]
    alternatives = [it for table in tables for it in table.get("oneOf", [table])]
    keys = {
        key
        for table in alternatives
        for key, value in table.get("properties", {}).items()
        if "const" not in value
    }
    assert len(keys) <= MOST_KEYS
