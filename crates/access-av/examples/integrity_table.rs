//! Protection levels, alarms and false alarms, nominal and under each fault:
//! `cargo run --release --example integrity_table -- [runs] [seed]`.

use std::error::Error;

use access_av::localize::IntegrityState;
use access_av::onboard::Custom;
use access_av::platform::Platform;
use access_av::scenario::{FaultKind, FaultSettings, Scenario};
use access_av::simulate::{CampaignOptions, RunRecord, Simulation};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().map_or(Ok(40), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let shipped = Scenario::load("nlos-and-faults")?;
    let alone = |what| {
        vec![FaultSettings {
            from_s: 25.0,
            until_s: 60.0,
            what,
        }]
    };
    let cases = [
        ("nominal", Vec::new()),
        (
            "non-line-of-sight",
            alone(FaultKind::NonLineOfSight {
                radio_head: 3,
                bias_rad: 0.5,
            }),
        ),
        (
            "moved head",
            alone(FaultKind::MovedHead {
                radio_head: 0,
                by_m: [25.0, 0.0],
            }),
        ),
        ("slip", alone(FaultKind::OdometerSlip { ratio: 1.2 })),
        (
            "stuck antenna",
            alone(FaultKind::StuckAntenna { antenna: 1 }),
        ),
        ("all, one by one", shipped.faults.clone()),
    ];
    println!("{runs} runs, seed {seed}");
    println!(
        "case               beyond PL while ok  not ok  PL/error  worst m  late alarms  alarms/h"
    );
    for (name, faults) in cases {
        let mut scenario = shipped.clone();
        scenario.faults = faults;
        let records = drive(scenario, runs, seed)?;
        Table::new(&records).print(name);
    }
    Ok(())
}

fn drive(scenario: Scenario, runs: usize, seed: u64) -> Result<Vec<RunRecord>, Box<dyn Error>> {
    let platform = Platform::load(&scenario.platform.name)?;
    let simulation = Simulation::new(scenario, platform)?;
    let campaign = simulation.campaign(&CampaignOptions {
        seed,
        first_run: 0,
        runs,
        threads: None,
        keep_records: true,
        custom: &Custom::default,
        progress: &|_| true,
    })?;
    Ok(campaign.records)
}

#[derive(Default)]
struct Table {
    epochs: usize,
    ok: usize,
    beyond: usize,
    ratios: Vec<f64>,
    worst_m: f64,
    late: usize,
    alarms: usize,
    hours: f64,
}

impl Table {
    fn new(records: &[RunRecord]) -> Self {
        const ALERT_LIMIT_M: f64 = 1.5;
        let mut table = Self::default();
        for record in records {
            let (mut was_ok, mut exceeded_s) = (true, f64::INFINITY);
            for step in &record.steps {
                let Some(integrity) = step.integrity else {
                    continue;
                };
                let error_m = step.truth.point().distance_m(step.estimate.point());
                let ok = integrity.state == IntegrityState::Ok;
                table.epochs += 1;
                table.ok += usize::from(ok);
                table.beyond += usize::from(ok && error_m > integrity.protection_level_m);
                table.alarms += usize::from(was_ok && !ok);
                table.worst_m = table.worst_m.max(error_m);
                if error_m > ALERT_LIMIT_M {
                    exceeded_s = exceeded_s.min(step.time_s);
                } else {
                    exceeded_s = f64::INFINITY;
                }
                table.late += usize::from(ok && step.time_s > exceeded_s + 1.0);
                table
                    .ratios
                    .push(integrity.protection_level_m / error_m.max(1e-3));
                was_ok = ok;
            }
            table.hours += record.steps.last().map_or(0.0, |step| step.time_s) / 3600.0;
        }
        table.ratios.sort_by(f64::total_cmp);
        table
    }

    fn print(&self, name: &str) {
        let median = self.ratios.get(self.ratios.len() / 2);
        println!(
            "{name:18} {:8.1e} of {:8} {:5.1} % {:7.1} {:9.2} {:10} {:10.1}",
            self.beyond as f64 / self.ok.max(1) as f64,
            self.epochs,
            100.0 * (1.0 - self.ok as f64 / self.epochs.max(1) as f64),
            median.copied().unwrap_or(f64::NAN),
            self.worst_m,
            self.late,
            self.alarms as f64 / self.hours,
        );
    }
}
