"""IQ recordings of users: retuned, in other units, data types and containers."""

from __future__ import annotations

import json
import tarfile
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av import RecordingError, nr
from access_av._core import Recording

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]

RATE_HZ = 7.68e6
SSB_HZ = 3489.6e6
OTHER_HZ = 3501.12e6


def burst(pci: int, ssb_hz: float = SSB_HZ, centre_hz: float | None = None) -> np.ndarray:
    """Half a frame with one SSB, 20 dB per resource element, received at a centre frequency."""
    sent = nr.build_burst(pci, ssb_indices=[0], sfn=100, ssb_freq_hz=ssb_hz)
    offset_hz = ssb_hz - (ssb_hz if centre_hz is None else centre_hz)
    turning = np.exp(2j * np.pi * offset_hz * np.arange(sent.size) / RATE_HZ)
    sigma = np.sqrt(0.5 * 0.01 / 256)
    noise = np.random.default_rng(pci).normal(scale=sigma, size=(sent.size, 2)) @ [1, 1j]
    return np.asarray(sent * turning + noise, dtype=np.complex64)


def write(
    stem: Path,
    samples: np.ndarray,
    captures: list[tuple[int, float | None]],
    datatype: str = "cf32_le",
) -> Path:
    """A recording; each capture has its first sample and its centre frequency."""
    samples.tofile(f"{stem}.sigmf-data")
    named: list[dict[str, Any]] = [{"core:sample_start": start} for start, _ in captures]
    for capture, (_, hz) in zip(named, captures, strict=True):
        if hz is not None:
            capture["core:frequency"] = hz
    meta = {
        "global": {
            "core:datatype": datatype, "core:sample_rate": RATE_HZ, "core:version": "1.2.0",
            "core:num_channels": 1,
        },
        "captures": named,
        "annotations": [],
    }  # fmt: skip
    file = stem.with_name(f"{stem.name}.sigmf-meta")
    file.write_text(json.dumps(meta))
    return file


def cells_of(file: Path) -> list[nr.Cell]:
    return nr.scan_as_recorded(Recording.open(file)).cells


def found(file: Path) -> list[tuple[int, float]]:
    """PCI and frequency (MHz) of each decoded SSB, in order of time."""
    decoded = [it for it in cells_of(file) if it.sfn is not None]
    return [(it.pci, round(it.ssb_freq_hz / 1e6, 3)) for it in decoded]


@pytest.mark.parametrize("hops", [[SSB_HZ, OTHER_HZ], [OTHER_HZ, SSB_HZ, OTHER_HZ]])
def test_each_capture_has_its_own_frequency(tmp_path: Path, hops: list[float]) -> None:
    parts = [burst(pci, hz) for pci, hz in enumerate(hops, 1)]
    starts = np.cumsum([0, *(it.size for it in parts)])
    captures = [(int(start), hz) for start, hz in zip(starts, hops, strict=False)]
    file = write(tmp_path / "hops", np.concatenate(parts), list(captures))
    assert found(file) == [(pci, hz / 1e6) for pci, hz in enumerate(hops, 1)]
    samples = [it.sample_start for it in cells_of(file) if it.sfn is not None]
    assert [int(np.searchsorted(starts, it)) for it in samples] == list(range(1, len(hops) + 1))


def test_one_cell_is_found_at_either_centre(tmp_path: Path) -> None:
    centre_hz = SSB_HZ + 0.18e6
    samples = np.concatenate([burst(3), burst(3, centre_hz=centre_hz)])
    file = write(tmp_path / "retuned", samples, [(0, SSB_HZ), (samples.size // 2, centre_hz)])
    assert found(file) == [(3, SSB_HZ / 1e6)] * 2
    # A capture without a frequency continues the one before it.
    samples = np.concatenate([burst(3), burst(4)])
    file = write(tmp_path / "same", samples, [(0, SSB_HZ), (samples.size // 2, None)])
    assert found(file) == [(3, SSB_HZ / 1e6), (4, SSB_HZ / 1e6)]


def test_samples_before_and_after_a_gap_make_no_ssb(tmp_path: Path) -> None:
    half = burst(3)
    [first] = [it for it in cells_of(write(tmp_path / "one", half, [(0, SSB_HZ)])) if it.sfn]
    # A gap in the middle of the first of three SSBs: only the others are whole.
    cut = round(first.sample_start) + 548
    samples = np.concatenate([half, half, half])
    assert len(found(write(tmp_path / "whole", samples, [(0, SSB_HZ), (cut, SSB_HZ)]))) == 3
    file = write(tmp_path / "gap", samples, [(0, SSB_HZ), (cut, SSB_HZ)])
    meta = json.loads(file.read_text())
    meta["captures"][1]["core:global_index"] = cut + 1_000_000
    file.write_text(json.dumps(meta))
    decoded = [it.sample_start for it in cells_of(file) if it.sfn is not None]
    expected = [first.sample_start + half.size * number for number in (1, 2)]
    assert decoded == pytest.approx(expected, abs=1)


@pytest.mark.parametrize(
    ("later_s", "whole"), [(0.0, 3), (0.01, 3), (5.0, 2)], ids=["contiguous", "late stamp", "gap"]
)
def test_dates_separate_captures(tmp_path: Path, later_s: float, whole: int) -> None:
    """Two captures without `core:global_index`; the cut is in the middle of the first SSB."""
    half = burst(3)
    [first] = [it for it in cells_of(write(tmp_path / "one", half, [(0, SSB_HZ)])) if it.sfn]
    cut = round(first.sample_start) + 548
    file = write(tmp_path / "two", np.concatenate([half] * 3), [(0, SSB_HZ), (cut, SSB_HZ)])
    meta = json.loads(file.read_text())
    for capture, time_s in zip(meta["captures"], (0.0, cut / RATE_HZ + later_s), strict=True):
        capture["core:datetime"] = f"2026-05-01T12:00:{time_s:09.6f}Z"
    file.write_text(json.dumps(meta))
    assert len(found(file)) == whole


def test_a_drive_needs_gaps_of_known_duration(access_av: Cli, tmp_path: Path) -> None:
    samples = np.vstack([np.concatenate([burst(3)] * 2)] * 2).T.copy()
    site, vehicle = tmp_path / "site.toml", tmp_path / "vehicle.toml"
    site.write_text('name = "hall"\n[[radio_heads]]\npci = 3\nposition_m = [5.0, 0.0, 3.0]\n')
    vehicle.write_text('name = "robot"\n[array]\nelements = 2\n')
    file = write(tmp_path / "cut", samples, [(0, SSB_HZ), (len(samples) // 2, SSB_HZ)])
    meta = json.loads(file.read_text())
    meta["global"]["core:num_channels"] = 2
    for second, says in ((9, "must be known to a millisecond"), (-9, "earlier than the end")):
        for capture, time_s in zip(meta["captures"], (20, 20 + second), strict=True):
            capture["core:datetime"] = f"2026-05-01T12:00:{time_s:02d}Z"
        file.write_text(json.dumps(meta))
        options = ["--site", site, "--vehicle", vehicle, "--out", tmp_path / "o"]
        done = access_av("record", "angles", file, *options)
        assert done.code == 2
        said = " ".join(done.err.split())
        assert "captures[1].core:datetime" in said
        assert says in said


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_wrong_sample_rate_is_named(access_av: Cli, tmp_path: Path, ratio: float) -> None:
    sent = nr.build_burst(5, ssb_indices=[0], ssb_freq_hz=SSB_HZ, sample_rate_hz=2 * RATE_HZ)
    noise = np.random.default_rng(1).normal(scale=6e-3, size=(sent.size, 2)) @ [1, 1j]
    file = write(tmp_path / "rate", (sent + noise).astype(np.complex64), [(0, SSB_HZ)])
    meta = json.loads(file.read_text())
    meta["global"]["core:sample_rate"] = 2 * RATE_HZ * ratio
    file.write_text(json.dumps(meta))
    done = access_av("record", "scan", file, "--json")
    said = " ".join(done.err.split())
    assert f"at the specified sample rate of {2 * RATE_HZ * ratio:.0f} Hz" in said
    assert f"but at {2 * RATE_HZ:.0f} Hz: correct the sample rate" in said


def test_a_drive_has_one_centre_frequency(access_av: Cli, tmp_path: Path) -> None:
    samples = np.concatenate([burst(3), burst(3)])
    file = write(tmp_path / "retuned", samples, [(0, SSB_HZ), (samples.size // 2, OTHER_HZ)])
    site, vehicle = tmp_path / "site.toml", tmp_path / "vehicle.toml"
    site.write_text('name = "hall"\n[[radio_heads]]\npci = 3\nposition_m = [5.0, 0.0, 3.0]\n')
    vehicle.write_text('name = "robot"\n[array]\nelements = 1\n')
    done = access_av(
        "record", "angles", file, "--site", site, "--vehicle", vehicle, "--out", tmp_path / "o"
    )
    assert done.code == 2
    if "elements" not in done.err:
        assert "captures[1].core:frequency" in done.err


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (3489.6, "in MHz"), (3489600.0, "in kHz"), (3.4896, "in GHz"), (632640.0, "NR-ARFCN"),
        (26500.5, "in MHz"), (-3.4896e9, "must be in hertz"), (3.4896e12, "must be in hertz"),
    ],
)  # fmt: skip
def test_frequencies_in_other_units_are_rejected(
    access_av: Cli, tmp_path: Path, value: float, says: str
) -> None:
    file = write(tmp_path / "unit", burst(1), [(0, value)])
    with pytest.raises(RecordingError, match=rf"captures\[0\].core:frequency.*{says}"):
        Recording.open(file)
    good = write(tmp_path / "good", burst(1), [(0, SSB_HZ)])
    if value > 0:
        done = access_av("record", "scan", good, "--centre-hz", value)
        assert done.code == 2
        assert says in " ".join(done.err.split())
    raw = tmp_path / "unit.sigmf-data"
    with pytest.raises(RecordingError, match=f"centre frequency.*{says}"):
        Recording.open_raw([raw], sample_rate_hz=RATE_HZ, centre_frequency_hz=value)


def test_exchanged_i_and_q_are_found_and_reported(access_av: Cli, tmp_path: Path) -> None:
    right = burst(5, centre_hz=SSB_HZ + 0.18e6)
    exchanged = (right.imag + 1j * right.real).astype(np.complex64)
    for name, samples in {"exchanged": exchanged, "conjugate": right.conj()}.items():
        file = write(tmp_path / name, samples, [(0, SSB_HZ + 0.18e6)])
        done = access_av("record", "scan", file, "--json")
        [cell] = json.loads(done.out)
        assert (cell["pci"], cell["ssb_freq_hz"]) == (5, SSB_HZ)
        assert "I and Q are exchanged" in " ".join(done.err.split())
    file = write(tmp_path / "right", right, [(0, SSB_HZ + 0.18e6)])
    assert "exchanged" not in access_av("record", "scan", file, "--json").err


def as_integers(samples: np.ndarray, full_scale: float) -> np.ndarray:
    scale = full_scale / np.abs(samples.view(np.float32)).max()
    return (samples.view(np.float32) * scale).round().astype(np.int16)


@pytest.mark.parametrize("full_scale", [60.0, 2000.0, 32767.0])
def test_a_wrong_datatype_is_reported(tmp_path: Path, full_scale: float) -> None:
    integers = as_integers(burst(1), full_scale)
    file = write(tmp_path / "integers", integers, [(0, SSB_HZ)])
    with pytest.raises(RecordingError, match=r"core:datatype.*probably `ci16_le`"):
        Recording.open(file)
    with pytest.raises(RecordingError, match=r"probably `ci16_le`.*write a .sigmf-meta"):
        Recording.open_raw([tmp_path / "integers.sigmf-data"], sample_rate_hz=RATE_HZ)
    right = write(tmp_path / "right", integers, [(0, SSB_HZ)], "ci16_le")
    assert found(right) == [(1, SSB_HZ / 1e6)]
    floats = write(tmp_path / "floats", burst(1), [(0, SSB_HZ)], "ci16_le")
    with pytest.raises(RecordingError, match=r"core:datatype.*probably `cf32_le`"):
        Recording.open(floats)


# Class, change of the metadata, and the cause.
METADATA: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "string": (
        lambda it: it["captures"][0].update({"core:frequency": "3489.6e6"}),
        r'core:frequency` is string "3489.6e6"; it must be a number',
    ),
    "fraction": (
        lambda it: it["captures"][0].update({"core:sample_start": 0.5}),
        "core:sample_start` is .*; it must be an integer of at least 0",
    ),
    "one start": (
        lambda it: it["captures"].append({"core:sample_start": 0, "core:frequency": OTHER_HZ}),
        r"captures\[1\].core:sample_start` is 0; the previous capture begins at this sample",
    ),
    "global index back": (
        lambda it: (
            it["captures"][0].update({"core:global_index": 10**6}),
            it["captures"].append({"core:sample_start": 9, "core:global_index": 5}),
        ),
        r"captures\[1\].core:global_index` is 5; it must be at least 1000009",
    ),
    "global index as text": (
        lambda it: it["captures"][0].update({"core:global_index": "5"}),
        "core:global_index` is .*; it must be an integer",
    ),
}


@pytest.mark.parametrize("kind", METADATA)
def test_metadata_that_contradict_themselves_are_rejected(tmp_path: Path, kind: str) -> None:
    change, says = METADATA[kind]
    file = write(tmp_path / "odd", burst(7), [(0, SSB_HZ)])
    meta = json.loads(file.read_text())
    change(meta)
    file.write_text(json.dumps(meta))
    with pytest.raises(RecordingError, match=says):
        Recording.open(file)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.wav", b"RIFF\0\0\0\0WAVE", "is WAV; it must be a .sigmf-meta"),
        ("a.npy", b"\x93NUMPY\x01\0", "is NumPy; it must be"),
        ("a.h5", b"\x89HDF\r\n", "is HDF5; it must be"),
        ("a.bin", b"hello", "is in another format; it must be"),
        ("a.sigmf", b"\x1f\x8b\x08\0", r"is compressed \(gzip\); a SigMF archive is a tar file"),
        ("b.sigmf", b"hello" * 300, "it is damaged, or not a tar file"),
    ],
)
def test_files_other_than_recordings_are_rejected(
    tmp_path: Path, name: str, content: bytes, says: str
) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(RecordingError, match=says) as error:
        Recording.open(file)
    assert str(file) in str(error.value)
    assert str(error.value).isprintable()


def test_metadata_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    file = write(tmp_path / "marked", burst(7), [(0, SSB_HZ)])
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    assert Recording.open(file).length == burst(7).size


@pytest.mark.parametrize("around", [0, 1, 300])
def test_a_recording_of_one_ssb_is_searched(tmp_path: Path, around: int) -> None:
    samples = burst(9)
    [cell] = cells_of(write(tmp_path / "all", samples, [(0, SSB_HZ)]))
    start = round(cell.sample_start)
    # Four symbols of 256 samples with prefixes of 18.
    cut = samples[start - around : start + 4 * 274 + around]
    assert found(write(tmp_path / "one", cut, [(0, SSB_HZ)])) == [(9, SSB_HZ / 1e6)]


def archive(folder: Path, names: list[str]) -> Path:
    file = folder / "archive.sigmf"
    with tarfile.open(file, "w") as tar:
        for name in names:
            for half in ("sigmf-meta", "sigmf-data"):
                tar.add(folder / f"{name}.{half}", f"{name}/{name}.{half}")
    return file


def test_archives_are_read_in_place(access_av: Cli, tmp_path: Path) -> None:
    for pci, name in enumerate(("a", "b"), 1):
        write(tmp_path / name, burst(pci), [(0, SSB_HZ)])
    file = archive(tmp_path, ["b"])
    assert found(file) == [(2, SSB_HZ / 1e6)]
    whole, alone = Recording.open(file), Recording.open(tmp_path / "b.sigmf-meta")
    assert np.array_equal(whole.read(100, 50), alone.read(100, 50))
    with pytest.raises(RecordingError, match=r"extract one of a/a, b/b with `tar -xf`"):
        Recording.open(archive(tmp_path, ["a", "b"]))
    with pytest.raises(RecordingError, match=r"must hold a \.sigmf-meta file"):
        Recording.open(archive(tmp_path, []))
    file.write_bytes(b"no tar file" * 100)
    done = access_av("record", "scan", file)
    assert done.code == 2
    assert "SigMF archive (tar)" in " ".join(done.err.split())


def test_collections_name_their_recordings(tmp_path: Path) -> None:
    for pci, name in enumerate(("a", "b"), 1):
        write(tmp_path / name, burst(pci), [(0, SSB_HZ)])
    file = tmp_path / "all.sigmf-collection"

    def collect(*names: str) -> Path:
        streams = [{"name": name, "hash": "0"} for name in names]
        file.write_text(json.dumps({"collection": {"core:streams": streams}}))
        return file

    assert found(collect("b")) == [(2, SSB_HZ / 1e6)]
    with pytest.raises(RecordingError, match="give one of a, b"):
        Recording.open(collect("a", "b"))
    with pytest.raises(RecordingError, match=r"`collection.core:streams` is missing"):
        Recording.open(collect())
