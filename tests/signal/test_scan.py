from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av import RecordingError, Scenario, aoa, nr, synthesize

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]

SSB_HZ = 3700.8e6
RATE_HZ = 7.68e6


def array_burst(angle_deg: float = 50.0, **burst: object) -> np.ndarray:
    """Half a frame at four antennas, 20 dB per resource element."""
    sent = nr.build_burst(7, ssb_freq_hz=SSB_HZ, **burst)  # type: ignore[arg-type]
    steering = np.exp(1j * np.pi * np.cos(np.radians(angle_deg)) * np.arange(4))
    sigma = np.sqrt(0.5 * 0.01 / 256)
    noise = np.random.default_rng(3).normal(scale=sigma, size=(4, sent.size, 2)) @ [1, 1j]
    return np.asarray(np.outer(steering, sent) + noise, dtype=np.complex64)


def test_raw_files_of_each_antenna_are_scanned(access_av: Cli, tmp_path: Path) -> None:
    files = [tmp_path / f"antenna{index}.cf32" for index in range(4)]
    for file, samples in zip(files, array_burst(ssb_indices=[2], sfn=99), strict=True):
        samples.tofile(file)
    options = ["--sample-rate-hz", RATE_HZ, "--centre-hz", SSB_HZ, "--ssb-freq-hz", SSB_HZ]
    done = access_av("record", "scan", *files, *options, "--json")
    assert done.code == 0, done.err
    [cell] = json.loads(done.out)
    assert (cell["pci"], cell["ssb_index"], cell["sfn"]) == (7, 2, 99)
    assert cell["scs_khz"] == 30
    assert len(cell["mib_bits"]) == 24
    assert abs(cell["angle_deg"] - 50) < 5 * cell["sigma_deg"]
    assert cell["azimuth_deg"] == pytest.approx(90 - cell["angle_deg"], abs=1e-3)
    assert access_av("record", "scan", *files, *options).out.count("99") >= 1


def test_sixteen_antennas_have_an_angle() -> None:
    sent = nr.build_burst(7, ssb_indices=[1], ssb_freq_hz=SSB_HZ)
    steering = np.exp(1j * np.pi * np.cos(np.radians(50)) * np.arange(16))
    noise = np.random.default_rng(4).normal(scale=6e-3, size=(16, sent.size, 2)) @ [1, 1j]
    samples = np.outer(steering, sent) + noise
    [cell] = nr.search(samples, RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ)
    assert cell.verdict == "resolved"
    assert cell.angle_rad is not None
    assert cell.sigma_rad is not None
    assert abs(cell.angle_rad - np.radians(50)) < 5 * cell.sigma_rad


def searcher(**changes: object) -> nr.Searcher:
    settings: dict[str, object] = {
        "centre_frequency_hz": SSB_HZ, "ssb_freq_hz": SSB_HZ, "scs_khz": 30, "antennas": 4,
    }  # fmt: skip
    return nr.Searcher(RATE_HZ, **settings | changes)  # type: ignore[arg-type]


def values(cells: list[nr.Cell]) -> list[dict[str, object]]:
    return [nr.record(cell) for cell in cells]


def test_a_reused_searcher_equals_a_new_search() -> None:
    kept = searcher()
    for sfn in (5, 6):
        samples = array_burst(ssb_indices=[0, 3], sfn=sfn)
        there = {"centre_frequency_hz": SSB_HZ, "ssb_freq_hz": SSB_HZ, "scs_khz": 30}
        expected = values(nr.search(samples, RATE_HZ, **there))
        assert [value["sfn"] for value in expected] == [sfn, sfn]
        assert values(kept.search(samples)) == expected
    # Samples of another memory order or type are converted.
    assert values(kept.search(np.asfortranarray(samples))) == expected
    assert values(kept.search(samples.astype(np.complex128))) == expected
    # The samples are searched without a copy, and are not changed.
    before = samples.copy()
    before.flags.writeable = False
    assert values(kept.search(before)) == expected
    assert np.array_equal(before, samples)


def test_searchers_of_several_threads_do_not_disturb_each_other() -> None:
    bursts = [array_burst(ssb_indices=[0], sfn=sfn) for sfn in range(4)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda samples: searcher().search(samples), bursts))
    assert [cell.sfn for [cell] in found] == [0, 1, 2, 3]


def test_a_searcher_rejects_invalid_input_with_a_reason() -> None:
    with pytest.raises(RecordingError, match="below the 3840000 Hz"):
        nr.Searcher(1e6, centre_frequency_hz=0, ssb_freq_hz=0, scs_khz=15, antennas=1)
    for wrong, message in (
        ({"scs_khz": 60}, "allowed: 15, 30"),
        ({"antennas": 17}, "1 to 16"),
        ({"ssb_freq_hz": SSB_HZ + 3e6}, "does not fit"),
        ({"calibration": [1, 1]}, "channel"),
    ):
        with pytest.raises(ValueError, match=message):
            searcher(**wrong)
    kept, samples = searcher(), array_burst()
    with pytest.raises(RecordingError, match="3 channels given, 4 expected"):
        kept.search(samples[:3])
    with pytest.raises(RecordingError, match="less than the"):
        kept.search(samples[:, :300])
    samples[2, 9] = np.nan
    with pytest.raises(RecordingError, match="sample 9 of channel 2"):
        kept.search(samples)


def test_a_channel_estimate_carries_its_covariance() -> None:
    """Errors of the angles from the whitened channel agree with their standard deviations: 60 draws
    within 3 σ."""
    rng = np.random.default_rng(5)
    burst = nr.build_burst(42, ssb_indices=[1], sfn=6, ssb_freq_hz=SSB_HZ)
    noise_std = np.sqrt(0.5 * np.mean(np.abs(burst[np.abs(burst) > 0]) ** 2))
    searcher = nr.Searcher(
        RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ, scs_khz=30, antennas=4
    )
    deviations = []
    for phase in rng.uniform(-2.8, 2.8, 60):
        received = np.outer(np.exp(1j * phase * np.arange(4)), burst)
        noise = rng.normal(scale=noise_std, size=(*received.shape, 2)) @ [1, 1j]
        [cell] = searcher.search((received + noise).astype(np.complex64))
        looks = aoa.whiten(cell.channel, cell.channel_covariance)
        assert looks.shape[1] <= 16  # the taps of the channel's model
        found = aoa.maximum_likelihood(looks)
        deviations.append((found.phase_rad - phase) / found.phase_sigma_rad)
    assert 0.73 < np.sqrt(np.mean(np.square(deviations))) < 1.27

    covariance = cell.channel_covariance
    assert covariance.dtype == np.complex64
    np.testing.assert_allclose(covariance, covariance.conj().T, atol=1e-6)
    for wrong, said in (
        (covariance[:9], r"covariance of shape \(9, 240\)"),
        (covariance * np.nan, "must be finite"),
        (covariance * 0, "no positive eigenvalue"),
    ):
        with pytest.raises(ValueError, match=said):
            aoa.whiten(cell.channel, wrong)


def test_searched_and_tracked_cells_contain_the_channel() -> None:
    samples = array_burst()
    [found] = nr.search(samples, RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ)
    antennas = samples.shape[0]
    assert found.channel.shape == (antennas, 240)
    assert found.channel.dtype == np.complex64
    noise = np.array(found.noise_variance)
    snr_db = 10 * np.log10((np.abs(found.channel) ** 2).mean(axis=1) / noise)
    np.testing.assert_allclose(snr_db.mean(), found.snr_db, atol=1)

    receiver = nr.Receiver(
        RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ, scs_khz=30, antennas=antennas
    )
    silence = np.zeros((antennas, round(0.02 * RATE_HZ) - samples.shape[1]), np.complex64)
    period = np.concatenate([samples, silence], axis=1)
    cells = receiver.push(np.tile(period, 3)) + receiver.finish()
    assert [cell.pci for cell in cells] == 3 * [found.pci]
    for number, cell in enumerate(cells):
        start = found.sample_start + number * period.shape[1]
        assert abs(cell.sample_start - start) < 0.1
        gain = np.abs(cell.channel).mean() / np.abs(found.channel).mean()
        assert abs(gain - 1) < 0.1
        between = np.angle((cell.channel * cell.channel[0].conj()).mean(axis=1))
        expected = np.angle((found.channel * found.channel[0].conj()).mean(axis=1))
        np.testing.assert_allclose(between, expected, atol=0.1)

    with pytest.raises(RecordingError, match="antennas given"):
        receiver.push(samples[:1])
    with pytest.raises(RecordingError, match="period_s = 1"):
        nr.Receiver(
            RATE_HZ, centre_frequency_hz=0, ssb_freq_hz=0, scs_khz=30, antennas=1, period_s=1
        )
    samples[1, 5] = np.nan
    with pytest.raises(RecordingError, match="sample 5 of channel 1"):
        receiver.push(samples)


def test_search_rejects_invalid_input_with_a_reason() -> None:
    samples = array_burst()
    with pytest.raises(RecordingError, match="below the 3840000 Hz"):
        nr.search(samples, 1e6, centre_frequency_hz=SSB_HZ)
    with pytest.raises(RecordingError, match="less than the"):
        nr.search(samples[:, :300], RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ)
    with pytest.raises(ValueError, match="allowed: 15, 30"):
        nr.search(samples, RATE_HZ, centre_frequency_hz=SSB_HZ, scs_khz=60)
    samples[1, 5] = np.nan
    with pytest.raises(RecordingError, match="sample 5 of channel 1"):
        nr.search(samples, RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ)


def test_bursts_reject_invalid_cell_settings() -> None:
    for wrong in ({"pci": 1008}, {"ssb_indices": [8]}, {"case": "F"}, {"lmax": 5}, {"gains": [1]},
                  {"mib_bits": "01"}, {"sfn": 1024}, {"sample_rate_hz": 5e6}):  # fmt: skip
        with pytest.raises(ValueError, match=r".+"):
            nr.build_burst(**{"pci": 1, "ssb_indices": [0, 1], **wrong})  # type: ignore[arg-type]


def test_noise_contains_no_cell(access_av: Cli, tmp_path: Path) -> None:
    file = tmp_path / "noise.cf32"
    noise = np.random.default_rng(1).normal(size=(40_000, 2)) @ [1, 1j]
    noise.astype(np.complex64).tofile(file)
    options = ["--sample-rate-hz", RATE_HZ, "--centre-hz", SSB_HZ]
    assert json.loads(access_av("record", "scan", file, *options, "--json").out) == []
    assert "no SSB found" in access_av("record", "scan", file, *options).out


def test_an_empty_scan_reports_the_searched_range_and_a_hint(
    access_av: Cli, tmp_path: Path
) -> None:
    file = tmp_path / "noise.cf32"
    noise = np.random.default_rng(2).normal(size=(40_000, 2)) @ [1, 1j]
    noise.astype(np.complex64).tofile(file)
    options = ["--sample-rate-hz", RATE_HZ, "--centre-hz", SSB_HZ]
    output = " ".join(access_av("record", "scan", file, *options).out.split())
    for words in ("raster", "any frequency from", "the first 5 ms of 1 channel", "--cfo-ppm"):
        assert words in output


@pytest.mark.parametrize("scenario", ["yard", "paper-real-odometry-4"])
def test_synthesized_drives_are_scanned_without_parameters(scenario: str, tmp_path: Path) -> None:
    # 3500.0 MHz is not on any raster.
    drive = synthesize(scenario, tmp_path, duration_s=0.1)
    site = json.loads(Scenario.load(scenario).site.to_json())
    cells = nr.scan_as_recorded(nr.Recording.open(drive.recording)).cells
    decoded = {cell.pci for cell in cells if cell.mib_bits}
    assert decoded == {head["pci"] for head in site["radio_heads"]}
    assert {cell.ssb_freq_hz for cell in cells} == {3.5e9}


def test_real_recordings_are_scanned_without_parameters(access_av: Cli, data: Path) -> None:
    for name in ("oai-n78", "singtel-n1"):
        file = data / "captures" / f"{name}.sigmf-meta"
        [annotation] = json.loads(file.read_text())["annotations"]
        truth = annotation["nr:ssb"]
        cells = json.loads(access_av("record", "scan", file, "--json").out)
        cell = max(cells, key=lambda cell: cell["snr_db"])
        for key in ("pci", "ssb_index", "half_frame", "sfn", "ssb_freq_hz"):
            assert cell[key] == truth[key], (name, key)
        assert cell["mib_bits"] == truth["mib_bits_24"]
        assert cell["scs_khz"] * 1e3 == truth["scs_hz"]
        assert abs(cell["sample_start"] - annotation["core:sample_start"]) <= 6


def test_annotated_calibration_and_spacing_are_used(access_av: Cli, data: Path) -> None:
    file = data / "captures" / "semireal4_singtel-n1_day1_array1.sigmf-meta"
    cells = json.loads(access_av("record", "scan", file, "--json").out)
    errors_deg = []
    for annotation in json.loads(file.read_text())["annotations"]:
        start = annotation["core:sample_start"]
        truth_deg = annotation["aoa:truth"]["azimuth_from_broadside_deg"]
        near = [cell for cell in cells if abs(cell["sample_start"] - start) <= 6]
        best = max(near, key=lambda cell: cell["snr_db"])
        errors_deg.append(abs(best["azimuth_deg"] - truth_deg))
    # Bartlett with perfect timing: 5.7, 0.1, 0.8 and 2.2 degrees.
    assert np.mean(errors_deg) < 1.3 * 2.2


def test_angles_of_received_cells_agree_with_their_standard_deviations() -> None:
    carrier: dict[str, Any] = {"centre_frequency_hz": 3.7008e9, "ssb_freq_hz": 3.7008e9}
    receiver = nr.Receiver(7.68e6, scs_khz=30, antennas=4, **carrier)
    rng, cells = np.random.default_rng(24), []
    for number in range(60):
        burst = nr.build_burst(42, ssb_indices=[1], sfn=2 * number, ssb_freq_hz=3.7008e9)
        period = np.concatenate([burst, np.zeros(3 * burst.size, np.complex64)])
        noise = rng.normal(scale=0.03, size=(4, period.size, 2)) @ [1, 1j]
        cells += receiver.push(np.outer(np.exp(0.9j * np.arange(4)), period) + noise)
    cells += receiver.finish()
    assert len(cells) == 60
    z = [(cell.phase_rad - 0.9) / cell.phase_sigma_rad for cell in cells]
    # Four standard deviations of a mean of squares.
    assert np.mean(np.square(z)) == pytest.approx(1, abs=4 * np.sqrt(2 / 60))
    # More than four of sixty false alarms at a rate of 1 % have a probability of 4e-4.
    assert sum(cell.doubt != "" for cell in cells) <= 4
    again = aoa.maximum_likelihood_pilots(cells[0].blocks, noise_variance=1.0)
    assert again.phase_rad == pytest.approx(cells[0].phase_rad)
    assert again.phase_sigma_rad == pytest.approx(cells[0].phase_sigma_rad)
