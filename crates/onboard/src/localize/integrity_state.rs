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
    /// What it amounts to.
    pub state: IntegrityState,
    /// Radio heads found faulty.
    pub faulty: usize,
}
