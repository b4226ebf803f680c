"""Angles of arrival of a recording: samples, SSBs, angles and their standard deviations.

The Python form of `crates/recording/examples/angles_of_a_recording.rs`. Only the recording is
needed::

    access-av record synth yard --duration-s 2 --out drive
    python examples/angles_of_a_recording.py drive/iq.sigmf-meta
"""

import sys

from access_av import Recording, nr


def main() -> None:
    """Prints one line for each SSB."""
    if len(sys.argv) != 2:
        sys.exit("give a recording")
    print("sample_start,pci,ssb_index,phase_rad,phase_sigma_rad,snr_db,doubt")
    for cell in nr.scan(Recording.open(sys.argv[1])).cells:
        if cell.phase_rad is not None:
            print(
                f"{cell.sample_start:.0f},{cell.pci},{cell.ssb_index},{cell.phase_rad:.6f},"
                f"{cell.phase_sigma_rad:.6f},{cell.snr_db:.1f},{cell.doubt}"
            )


if __name__ == "__main__":
    main()
