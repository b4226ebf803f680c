//! Metrics in the text format of Prometheus.

use std::fmt::Write;

use super::board::StatusBoard;
use crate::health::OutputStatus;
use crate::statistics::{Histogram, SourceHealth};
use onboard::live::{HeadStatus, State};

/// Name, kind and help of a family, and its value for a source, output or radio head.
type Family<T, V> = (&'static str, &'static str, &'static str, fn(&T) -> V);

struct Text(String);

impl Text {
    fn family(&mut self, name: &str, kind: &str, help: &str) {
        // Writing into a string does not fail.
        let _ = writeln!(
            self.0,
            "# HELP access_av_{name} {help}\n# TYPE access_av_{name} {kind}"
        );
    }

    fn sample(&mut self, name: &str, labels: &[(&str, &str)], value: f64) {
        let labels: Vec<String> = labels
            .iter()
            .map(|(name, value)| format!("{name}=\"{}\"", escaped(value)))
            .collect();
        let labels = match labels.len() {
            0 => String::new(),
            _ => format!("{{{}}}", labels.join(",")),
        };
        let _ = writeln!(self.0, "access_av_{name}{labels} {value}");
    }

    fn one(&mut self, name: &str, kind: &str, help: &str, value: f64) {
        self.family(name, kind, help);
        self.sample(name, &[], value);
    }

    fn histogram(&mut self, name: &str, help: &str, histogram: &Histogram) {
        self.family(name, "histogram", help);
        let buckets = histogram.cumulative();
        for (upper_s, count) in &buckets {
            let upper = format!("{upper_s:.3e}");
            self.sample(&format!("{name}_bucket"), &[("le", &upper)], *count as f64);
        }
        let all = buckets.last().map_or(0, |(_, count)| *count) as f64;
        self.sample(&format!("{name}_bucket"), &[("le", "+Inf")], all);
        self.sample(&format!("{name}_sum"), &[], histogram.sum_s());
        self.sample(&format!("{name}_count"), &[], all);
    }
}

/// Returns all metrics of a node.
pub fn text(board: &StatusBoard) -> String {
    let mut text = Text(String::with_capacity(8192));
    let counters = &board.counters;
    let latency_stats = &counters.latency_stats;
    text.histogram(
        "ssb_to_pose_seconds",
        "Latency from the arrival of the last sample of an SSB to the pose that includes its \
         angle.",
        &latency_stats.ssb_to_pose,
    );
    text.histogram(
        "odometry_to_pose_seconds",
        "Latency from the arrival of an odometry sample to its pose.",
        &latency_stats.odometry_to_pose,
    );
    text.histogram(
        "pose_jitter_seconds",
        "Interval between two poses minus the interval between their odometry samples.",
        &latency_stats.jitter,
    );
    let [blocks, messages] = counters.inbox.dropped();
    text.family(
        "dropped_total",
        "counter",
        "Items that were dropped because they could not be processed in time.",
    );
    for (what, count) in [
        ("blocks", blocks),
        ("messages", messages),
        ("records", counters.records.dropped()),
    ] {
        text.sample("dropped_total", &[("what", what)], count as f64);
    }
    let of_sources: [Family<SourceHealth, f64>; 3] = [
        (
            "source_items_total",
            "counter",
            "Samples per channel, or messages, of a source.",
            |it| it.items() as f64,
        ),
        (
            "source_defects_total",
            "counter",
            "Items of a source that could not be used.",
            |it| it.defects() as f64,
        ),
        (
            "source_silent_seconds",
            "gauge",
            "Time since the last item of a source.",
            |it| it.silent_for().as_secs_f64(),
        ),
    ];
    for (name, kind, help, value) in of_sources {
        text.family(name, kind, help);
        for source in &counters.sources {
            text.sample(name, &[("source", source.name)], value(source));
        }
    }
    let of_outputs: [Family<OutputStatus, f64>; 5] = [
        (
            "output_up",
            "gauge",
            "1 while an output works, 0 while it has failed.",
            |it| f64::from(u8::from(it.ok)),
        ),
        (
            "output_failures_total",
            "counter",
            "Failures of an output.",
            |it| it.failures as f64,
        ),
        (
            "output_retries_total",
            "counter",
            "Attempts to open a failed output again.",
            |it| it.retries as f64,
        ),
        (
            "output_written_total",
            "counter",
            "Records written by an output.",
            |it| it.written as f64,
        ),
        (
            "output_dropped_total",
            "counter",
            "Records lost by an output that had failed or was too slow.",
            |it| it.dropped as f64,
        ),
    ];
    let outputs = counters.records.status();
    for (name, kind, help, value) in of_outputs {
        text.family(name, kind, help);
        for output in &outputs {
            text.sample(name, &[("output", output.name)], value(output));
        }
    }
    let Some(shown) = board.shown() else {
        return text.0;
    };
    let status = &shown.status;
    text.family(
        "state",
        "gauge",
        "1 for the current state of the pose, 0 for the others.",
    );
    for state in State::ALL {
        let value = f64::from(u8::from(state == status.state));
        text.sample("state", &[("state", state.name())], value);
    }
    text.family(
        "fault",
        "gauge",
        "1 for each active fault of odometry and receive channels.",
    );
    for active in status.faults.iter() {
        let subject = active.fault.subject();
        let labels = [("fault", active.fault.name()), ("subject", &*subject)];
        text.sample("fault", &labels, 1.0);
    }
    if let Some(pose) = status.pose {
        text.family("position_meters", "gauge", "Position in the map frame.");
        text.sample("position_meters", &[("axis", "x")], pose.x_m);
        text.sample("position_meters", &[("axis", "y")], pose.y_m);
        let help = "Heading from -pi to pi, counter-clockwise from the map's x axis.";
        text.one("heading_radians", "gauge", help, pose.heading_rad);
    }
    if let Some(level_m) = status.protection_level_m {
        let help = "Horizontal protection level.";
        text.one("protection_level_meters", "gauge", help, level_m);
    }
    let of_heads: [Family<HeadStatus, Option<f64>>; 5] = [
        (
            "head_snr_decibels",
            "gauge",
            "SNR of a radio head's last SSB.",
            |it| it.snr_db,
        ),
        (
            "head_residual_radians",
            "gauge",
            "Residual of a radio head's last angle.",
            |it| it.residual_rad,
        ),
        (
            "head_accepted_total",
            "counter",
            "Angles of a radio head that were accepted.",
            |it| Some(it.accepted as f64),
        ),
        (
            "head_refused_total",
            "counter",
            "Angles of a radio head that were rejected.",
            |it| Some(it.refused as f64),
        ),
        (
            "head_faulty",
            "gauge",
            "1 for a radio head that was identified as faulty.",
            |it| Some(f64::from(u8::from(it.is_faulty))),
        ),
    ];
    let names = board.site().heads;
    for (name, kind, help, value) in of_heads {
        text.family(name, kind, help);
        for head in &shown.heads {
            let (pci, beam) = (head.head.pci, head.head.ssb_index);
            let known = names.iter().find(|it| (it.0, it.1) == (pci, beam));
            let named = known.map_or("", |(_, _, name)| name.as_str());
            if let Some(value) = value(head) {
                let (pci, beam) = (pci.to_string(), beam.to_string());
                let labels = [("head", named), ("pci", &*pci), ("ssb_index", &*beam)];
                text.sample(name, &labels, value);
            }
        }
    }
    let energy = &shown.energy;
    let help = "SSB bursts received.";
    text.one(
        "bursts_total",
        "counter",
        help,
        energy.bursts_received as f64,
    );
    let help = "Angles estimated.";
    text.one("angles_total", "counter", help, energy.aoa_estimates as f64);
    if let Some(joules) = energy.energy {
        let help = "Energy since the start, by the energy model of the platform.";
        text.one("energy_joules_total", "counter", help, joules.total_j());
    }
    text.one(
        "ssbs_found_total",
        "counter",
        "SSBs that were found by a search; all others came at the expected time.",
        shown.counts.found as f64,
    );
    if let Some(duty) = board.duty(&shown) {
        let help = "Share of the samples that were processed.";
        text.one("duty_ratio", "gauge", help, duty);
    }
    text.0
}

/// Escapes the value of a label for Prometheus.
fn escaped(value: &str) -> String {
    value
        .replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('\n', "\\n")
}
