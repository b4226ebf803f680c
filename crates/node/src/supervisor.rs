//! Notifications to the service manager (`sd_notify(3)`): ready, alive, status, stopping. Without a service manager
//! they have no effect.

use std::io::Write;
use std::time::{Duration, Instant};

use sd_notify::NotifyState;

/// Notifies the service manager that the node is ready.
pub fn ready() {
    notify(NotifyState::Ready);
}

/// Notifies the service manager that the node ends.
pub fn stopping() {
    notify(NotifyState::Stopping);
}

/// Writes a line to standard error, which the service manager stores in its journal.
pub fn log(line: &str) {
    // A closed standard error must not stop the vehicle.
    let _ = writeln!(std::io::stderr(), "{line}");
}

fn notify(state: NotifyState<'_>) {
    // A service manager that does not receive must not stop the vehicle.
    let _ = sd_notify::notify(&[state]);
}

/// Watchdog and status of the thread that owns the pipeline.
#[derive(Debug)]
pub struct Watchdog {
    /// Half the time after which the service manager restarts the node.
    period: Option<Duration>,
    due: Instant,
    vehicle: String,
    outputs: Option<String>,
    sent: String,
}

impl Watchdog {
    /// Creates the watchdog that the service manager requests by environment variables.
    pub fn from_environment() -> Self {
        Self {
            period: sd_notify::watchdog_enabled().map(|it| it / 2),
            due: Instant::now(),
            vehicle: "no input yet".to_owned(),
            outputs: None,
            sent: String::new(),
        }
    }

    /// Reports that the thread is alive; to be called more often than the service manager requires.
    pub fn alive(&mut self) {
        let now = Instant::now();
        if let Some(period) = self.period
            && now >= self.due
        {
            self.due = now + period;
            notify(NotifyState::Watchdog);
        }
    }

    /// Sets the state of the vehicle in the status.
    pub fn set_vehicle(&mut self, vehicle: String) {
        self.vehicle = vehicle;
        self.send();
    }

    /// Sets the failed outputs in the status; `None` if all outputs work.
    pub fn set_outputs(&mut self, outputs: Option<String>) {
        self.outputs = outputs;
        self.send();
    }

    /// Sends the status if it has changed.
    fn send(&mut self) {
        let mut status = self.vehicle.clone();
        if let Some(outputs) = &self.outputs {
            status += "; ";
            status += outputs;
        }
        if status != self.sent {
            notify(NotifyState::Status(&status));
            self.sent = status;
        }
    }
}
