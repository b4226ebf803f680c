//! Whether, and how far, a position can be relied on.

/// Whether the position can be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum IntegrityState {
    /// The protection level holds and is below the alert limit.
    Ok,
    /// The protection level is above the alert limit, or a fault cannot be pinned down.
    Degraded,
    /// Several sources disagree at once, as when the array itself is at fault.
    Unavailable,
}

impl IntegrityState {
    /// Name for files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Degraded => "degraded",
            Self::Unavailable => "unavailable",
        }
    }
}

/// Protection level and state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrity {
    /// Horizontal protection level (m).
    pub protection_level_m: f64,
    /// Protection level along the vehicle's heading (m).
    pub protection_level_along_m: f64,
    /// Protection level across it (m).
    pub protection_level_across_m: f64,
    /// What it amounts to.
    pub state: IntegrityState,
    /// Radio heads found faulty.
    pub faulty: usize,
}

impl Integrity {
    /// Unavailable, with one level in every direction.
    pub const fn unavailable(level_m: f64) -> Self {
        Self {
            protection_level_m: level_m,
            protection_level_along_m: level_m,
            protection_level_across_m: level_m,
            state: IntegrityState::Unavailable,
            faulty: 0,
        }
    }

    /// Raises every level to `least_m`.
    pub const fn raise(&mut self, least_m: f64) {
        self.protection_level_m = self.protection_level_m.max(least_m);
        self.protection_level_along_m = self.protection_level_along_m.max(least_m);
        self.protection_level_across_m = self.protection_level_across_m.max(least_m);
    }
}
