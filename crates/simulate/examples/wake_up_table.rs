//! Cost and error of each wake-up policy on the yard with the shipped settings: `cargo run
//! --release -p simulate --example wake_up_table -- [runs] [seed ...]`.
//!
//! Every policy drives the same runs over the same radio channel.
#![allow(clippy::print_stdout, reason = "prints a table")]

mod common;
#[path = "../tests/all/statistics.rs"]
mod statistics;

use onboard::settings::WakeUpSettings;
use simulate::scenario::Scenario;

use common::{Result, arguments, campaign, changed, fixed};
use statistics::CampaignStatistics;

/// One policy with one outcome per seed.
struct Policy {
    name: String,
    scenario: Scenario,
    outcomes: Vec<Outcome>,
}

struct Outcome {
    p90_m: f64,
    aoa_estimates: f64,
    bursts_received: f64,
    out_of_reach: f64,
}

fn main() -> Result<()> {
    let (runs, seeds) = arguments(30, 11)?;
    let mut policies = policies()?;
    for policy in &mut policies {
        for &seed in &seeds {
            policy.outcomes.push(drive(&policy.scenario, runs, seed)?);
        }
    }

    println!("yard, {runs} runs of each, seeds {seeds:?}");
    println!("policy                 p90 m  aoa_estimates    receptions  target unreachable");
    for policy in &policies {
        println!(
            "{:20} {:7.3} {:11.0} {:13.0} {:17.1} %",
            policy.name,
            policy.mean(|it| it.p90_m),
            policy.mean(|it| it.aoa_estimates),
            policy.mean(|it| it.bursts_received),
            100.0 * policy.mean(|it| it.out_of_reach),
        );
    }
    println!("\nratios: mean, minimum and maximum over the seeds");
    println!("policy               against             share of aoa_estimates      p90 over p90");
    let (driven, references): (Vec<_>, Vec<_>) = policies.iter().partition(|policy| {
        matches!(
            policy.scenario.vehicle.wake_up,
            Some(WakeUpSettings::Uncertainty(_))
        )
    });
    for policy in driven {
        for reference in &references {
            let share = policy.against(reference, |it| it.aoa_estimates);
            let error = policy.against(reference, |it| it.p90_m);
            println!("{:20} {:18} {share}   {error}", policy.name, reference.name);
        }
    }
    Ok(())
}

fn policies() -> Result<Vec<Policy>> {
    let policy = |name: &str, scenario: Scenario| Policy {
        name: name.to_owned(),
        scenario,
        outcomes: Vec::new(),
    };
    let mut policies = Vec::new();
    for base_ms in [80.0, 150.0] {
        let settings = [
            ("vehicle.wake_up.policy", "pid".into()),
            ("vehicle.wake_up.base_ms", base_ms.into()),
        ];
        let name = format!("PID, base {base_ms} ms");
        policies.push(policy(&name, changed("yard", settings)?));
    }
    for interval_ms in [20.0, 240.0] {
        let name = format!("fixed {interval_ms} ms");
        policies.push(policy(&name, changed("yard", fixed(interval_ms))?));
    }
    policies.push(policy("uncertainty", changed("yard", [])?));
    Ok(policies)
}

fn drive(scenario: &Scenario, runs: usize, seed: u64) -> Result<Outcome> {
    let campaign = campaign(scenario, seed, runs)?;
    let bursts_received: usize = campaign.runs.iter().map(|run| run.bursts_received).sum();
    let out_of_reach: usize = campaign.runs.iter().map(|run| run.out_of_reach).sum();
    Ok(Outcome {
        p90_m: campaign.errors.quantile_m(0.9).unwrap_or(f64::NAN),
        aoa_estimates: campaign.mean_aoa_estimates(),
        bursts_received: bursts_received as f64 / runs as f64,
        out_of_reach: out_of_reach as f64 / (runs * campaign.steps.len()) as f64,
    })
}

impl Policy {
    fn mean(&self, of: impl Fn(&Outcome) -> f64) -> f64 {
        self.outcomes.iter().map(of).sum::<f64>() / self.outcomes.len() as f64
    }

    /// Returns the ratio of a metric to that of another policy with equal seeds: mean, minimum and
    /// maximum.
    fn against(&self, other: &Self, of: impl Fn(&Outcome) -> f64) -> String {
        let ratios: Vec<f64> = (self.outcomes.iter().zip(&other.outcomes))
            .map(|(mine, theirs)| of(mine) / of(theirs))
            .collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        let most = ratios.iter().copied().fold(0.0, f64::max);
        format!("{mean:.3} ({least:.3} … {most:.3})")
    }
}
