//! What the service manager is told (`sd_notify(3)`): that the node is ready, that its pipeline is alive, how it
//! stands, that it ends. Where there is none, nobody is.

use std::time::{Duration, Instant};

use sd_notify::NotifyState;

/// Everything is open.
pub fn ready() {
    tell(NotifyState::Ready);
}

/// The node ends.
pub fn stopping() {
    tell(NotifyState::Stopping);
}

fn tell(state: NotifyState<'_>) {
    // A service manager that does not listen must not stop the vehicle.
    let _ = sd_notify::notify(&[state]);
}

/// Vouches for the thread that owns it.
#[derive(Debug)]
pub struct Watchdog {
    /// Half the time after which the service manager takes the node for hung.
    period: Option<Duration>,
    due: Instant,
    said: String,
}

impl Watchdog {
    /// As the service manager asks for it in the environment.
    pub fn from_environment() -> Self {
        Self {
            period: sd_notify::watchdog_enabled().map(|it| it / 2),
            due: Instant::now(),
            said: String::new(),
        }
    }

    /// The thread is alive; to be called more often than the service manager asks.
    pub fn alive(&mut self) {
        let now = Instant::now();
        if let Some(period) = self.period
            && now >= self.due
        {
            self.due = now + period;
            tell(NotifyState::Watchdog);
        }
    }

    /// How the node stands, in words; what was said already is not repeated.
    pub fn say(&mut self, state: String) {
        if state != self.said {
            tell(NotifyState::Status(&state));
            self.said = state;
        }
    }
}
